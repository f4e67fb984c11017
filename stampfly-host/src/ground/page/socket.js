// Where vehicles are: at the server that this page came from.

const openSocket = () => new WebSocket(`${location.origin.replace(/^http/, 'ws')}/ws`);
const logAddress = (vehicle) => `/log/${vehicle}`;
