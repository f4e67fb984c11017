'use strict';
// The flight stack and its world: a WebAssembly module, moved on by the wall's time.

const STEP_MS = 10;
/** After a pause of the browser, at most so much is made up for. */
const MOST_MS = 100;
let flight = null;
let speed = 1;
let last = 0;

const bytesOf = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
const left = (length) => new Uint8Array(flight.memory.buffer, flight.text_place(), length).slice();
const textOf = (length) => new TextDecoder().decode(left(length));

const hear = (text) => {
  const bytes = new TextEncoder().encode(text);
  new Uint8Array(flight.memory.buffer, flight.text_room(bytes.length), bytes.length).set(bytes);
  flight.hear();
};

/** Time is this worker's. */
const setSpeed = ({ vehicle, id, factor }) => {
  const ok = Number.isFinite(factor) && factor >= 0 && factor <= 100;
  if (ok) speed = factor;
  const reply = { vehicle, id, ok, text: ok ? String(factor) : 'out of range', value: ok ? factor : null };
  postMessage({ text: JSON.stringify({ reply }) });
};

const fly = () => {
  const now = performance.now();
  const passed = Math.min(now - last, MOST_MS);
  last = now;
  if (speed > 0) flight.go_on(Math.round(passed * speed * 1000));
  for (const text of textOf(flight.say()).split('\n')) if (text) postMessage({ text });
};

const start = async (module) => {
  const { instance } = await WebAssembly.instantiate(bytesOf(module), {});
  flight = instance.exports;
  flight.begin(1);
  last = performance.now();
  postMessage({ ready: true });
  setInterval(fly, STEP_MS);
};

addEventListener('message', ({ data }) => {
  if (data.module) start(data.module);
  else if (data.text) {
    const asked = data.text.includes('"speed"') ? JSON.parse(data.text) : {};
    if (asked.do === 'speed') setSpeed(asked);
    else hear(data.text);
  } else if ('log' in data) postMessage({ vehicle: data.log, log: left(flight.log(data.log)) });
  else if ('reference' in data) {
    const begun = performance.now();
    const said = JSON.parse(textOf(flight.reference(data.reference)));
    const wall_s = (performance.now() - begun) / 1000;
    last = performance.now();
    postMessage({ reference: JSON.stringify({ ...said, wall_s }) });
  }
});
