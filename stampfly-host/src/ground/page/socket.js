// Where vehicles are: at the server that this page came from.

// Behind the # of an address is what a browser does not send: a secret, where others can reach the server.
const secret = () => (location.hash.length > 1 ? `?secret=${encodeURIComponent(location.hash.slice(1))}` : '');
const watchesLink = true;
const openSocket = () => new WebSocket(`${location.origin.replace(/^http/, 'ws')}/ws${secret()}`);
const logAddress = (vehicle) => `/log/${vehicle}${secret()}`;
