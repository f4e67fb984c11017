// Where vehicles are: in this page. A worker has the flight stack and its world; it is spoken to as a server would be.

const local = { worker: null, logs: new Map() };

/** As much of a WebSocket as the page uses. */
class LocalSocket extends EventTarget {
  constructor() {
    super();
    this.bufferedAmount = 0;
    const code = new Blob([document.getElementById('worker').textContent], { type: 'text/javascript' });
    local.worker = new Worker(URL.createObjectURL(code));
    local.worker.addEventListener('message', ({ data }) => {
      if (data.ready) this.dispatchEvent(new Event('open'));
      else if (data.log) local.logs.get(data.vehicle)?.(data.log);
      else if (data.reference) local.reference?.(JSON.parse(data.reference));
      else this.dispatchEvent(new MessageEvent('message', { data: data.text }));
    });
    local.worker.addEventListener('error', () => this.dispatchEvent(new Event('close')));
    local.worker.postMessage({ module: document.getElementById('module').textContent.trim() });
  }

  send(text) { local.worker.postMessage({ text }); }
}

const watchesLink = false;
const openSocket = () => new LocalSocket();
const logAddress = () => '#';

/** The log of a vehicle so far, as a file. */
const logSoFar = (vehicle) => new Promise((resolve) => {
  local.logs.set(vehicle.number, (bytes) => resolve(new File([bytes], `${vehicle.card.name.replaceAll(/\W+/g, '-').toLowerCase()}.ulg`)));
  local.worker.postMessage({ log: vehicle.number });
});

/** The reference mission, flown as fast as this machine can: its hash, and how fast. */
const flyReference = (seed) => new Promise((resolve) => {
  local.reference = resolve;
  local.worker.postMessage({ reference: seed });
});
window.flyReference = flyReference;
