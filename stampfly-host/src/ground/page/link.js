// The WebSocket: what the server tells, what the page asks, and how well it goes.

const RATE = 50;
const link = { socket: null, next: 1, waiting: new Map(), texts: 0, dropped: 0, rate: 0, delay: NaN, since: 0, isOpen: false };
const listeners = { hello: [], state: [], event: [], link: [] };
const on = (kind, listener) => listeners[kind].push(listener);
const tell = (kind, value) => listeners[kind].forEach((listener) => listener(value));

const ANSWER_TIME = 5000;

/** Asks something; the promise is the reply, `{ok, text, value}`. Never rejected. */
const ask = (vehicle, what) => new Promise((resolve) => {
  const id = link.next++;
  if (!link.isOpen) { resolve({ ok: false, text: 'not connected' }); return; }
  const timer = setTimeout(() => {
    link.waiting.delete(id);
    resolve({ ok: false, text: 'no answer' });
  }, ANSWER_TIME);
  link.waiting.set(id, { resolve, timer, since: performance.now() });
  link.socket.send(JSON.stringify(vehicle === null ? { id, ...what } : { vehicle, id, ...what }));
});

/** Asks what has no answer. */
const say = (vehicle, what) => {
  if (link.isOpen && link.socket.bufferedAmount < 20000) link.socket.send(JSON.stringify({ vehicle, id: 0, ...what }));
};

const subscribe = (topics) => ask(null, { do: 'subscribe', topics, rate: RATE });

const heard = (text) => {
  const message = JSON.parse(text);
  if (message.state) {
    link.texts++;
    link.dropped = message.dropped;
    tell('state', message.state);
  } else if (message.reply) {
    const waiting = link.waiting.get(message.reply.id);
    if (!waiting) return;
    clearTimeout(waiting.timer);
    link.waiting.delete(message.reply.id);
    link.delay = performance.now() - waiting.since;
    waiting.resolve(message.reply);
  } else if (message.event) tell('event', message.event);
  else if (message.hello) tell('hello', message.hello);
};

const connect = () => {
  const socket = openSocket();
  link.socket = socket;
  socket.addEventListener('open', () => { link.isOpen = true; tell('link', true); });
  socket.addEventListener('message', (event) => heard(event.data));
  socket.addEventListener('close', () => {
    link.isOpen = false;
    for (const { resolve, timer } of link.waiting.values()) {
      clearTimeout(timer);
      resolve({ ok: false, text: 'the connection broke' });
    }
    link.waiting.clear();
    tell('link', false);
    setTimeout(connect, 1000);
  });
};

const SIGN_OF_LIFE = 500;

/** Tells these vehicles again and again that somebody is there. */
const stayAlive = (vehicles) => {
  clearInterval(link.alive);
  link.alive = setInterval(() => vehicles.forEach((vehicle) => say(vehicle, { do: 'alive' })), SIGN_OF_LIFE);
};
on('hello', ({ vehicles }) => stayAlive(vehicles.filter(({ offers }) => offers.includes('alive')).map(({ number }) => number)));

/** Measures the rate of what arrives; called once a second. */
const measureLink = () => {
  const now = performance.now();
  link.rate = (link.texts * 1000) / Math.max(now - link.since, 1);
  link.texts = 0;
  link.since = now;
};

