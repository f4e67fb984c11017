// The WebSocket: what the server tells, what the page asks, and how well it goes.

const RATE = 50;
const link = { session: null, page: null, socket: null, heard: 0, next: 1, waiting: new Map(), texts: 0, dropped: 0, rate: 0, delay: NaN, since: 0, isOpen: false };
const listeners = { hello: [], state: [], event: [], link: [] };
const on = (kind, listener) => listeners[kind].push(listener);
const tell = (kind, value) => listeners[kind].forEach((listener) => listener(value));

const ANSWER_TIME = 5000;

// The server tells its clock with every text. The largest difference to this page's is of the text that came fastest, so the sum is never ahead
// of the server's clock: what is asked is at worst taken for older than it is. What comes more than a second late is not done.
const DRIFT = 1e-4;
const hearClock = (now) => {
  const here = performance.now();
  const known = link.clock ? link.clock.now + (here - link.clock.here) * (1 - DRIFT) : -Infinity;
  if (now > known) link.clock = { now, here };
};
const serverTime = () => (link.clock ? { at: Math.max(0, Math.round(link.clock.now + (performance.now() - link.clock.here) * (1 - DRIFT))) } : {});

// A server that is there says something fifty times a second. What it said last is old after this time, and nothing more is asked.
const OLD = 1000;
/** Is the server heard, and its clock known? */
const isHeard = () => link.isOpen && (!watchesLink || (link.clock !== null && performance.now() - link.heard <= OLD));

/** What ends a flight is right at any time: it is sent although nothing is heard. */
const endsAFlight = (what) => what.do === 'motor_stop' || (what.do === 'guided' && ['kill', 'land'].includes(what.kind));

/** Asks something; the promise is the reply, `{ok, text, value}`. Never rejected. */
const ask = (vehicle, what) => new Promise((resolve) => {
  const id = link.next++;
  if (!link.isOpen) { resolve({ ok: false, text: 'not connected: it was not sent' }); return; }
  if (vehicle !== null && !isHeard() && !endsAFlight(what)) { resolve({ ok: false, text: 'the server is not heard: it was not sent' }); return; }
  const timer = setTimeout(() => {
    link.waiting.delete(id);
    resolve({ ok: false, text: 'no answer' });
  }, ANSWER_TIME);
  link.waiting.set(id, { resolve, timer, since: performance.now() });
  link.socket.send(JSON.stringify(vehicle === null ? { id, ...what } : { vehicle, id, ...serverTime(), ...what }));
});

/** Asks what has no answer. */
const say = (vehicle, what) => {
  if (link.isOpen && link.socket.bufferedAmount < 20000) link.socket.send(JSON.stringify({ vehicle, id: 0, ...serverTime(), ...what }));
};

const subscribe = (topics) => ask(null, { do: 'subscribe', topics, rate: RATE });

const heard = (text) => {
  const message = JSON.parse(text);
  if (message.state) {
    hearClock(message.now);
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
  else if (message.hello) { hearClock(message.hello.now); tell('hello', message.hello); }
};

const connect = () => {
  const socket = openSocket();
  link.socket = socket;
  link.clock = null;
  link.last = performance.now();
  socket.addEventListener('open', () => { if (socket === link.socket) { link.isOpen = true; link.last = performance.now(); tell('link', true); } });
  socket.addEventListener('message', (event) => { if (socket === link.socket) { link.last = link.heard = performance.now(); heard(event.data); } });
  socket.addEventListener('close', () => { if (socket === link.socket) giveUp(); });
};

/** The connection is gone, or says nothing: no answer will come, and a new connection is tried. What was asked just before may have been done. */
const giveUp = () => {
  const socket = link.socket;
  link.socket = null;
  link.isOpen = false;
  for (const { resolve, timer } of link.waiting.values()) {
    clearTimeout(timer);
    resolve({ ok: false, text: 'the connection broke before an answer: look whether it was done' });
  }
  link.waiting.clear();
  socket?.close();
  tell('link', false);
  setTimeout(connect, 500);
};

// After this time another connection is tried.
const SILENT = 2000;
const watchLink = () => { if (link.isOpen && performance.now() - link.last > SILENT) giveUp(); };
if (watchesLink) setInterval(watchLink, 250);

// The page goes on as who it was before its connection broke, so that it keeps the vehicle that it flies.
on('hello', ({ page }) => {
  const { session: before, page: number } = link;
  link.page = page?.number ?? null;
  link.session = page?.session || null;
  if (!before || !link.session || before === link.session) return;
  ask(null, { do: 'resume', session: before }).then(({ ok }) => { if (ok) Object.assign(link, { session: before, page: number }); });
});

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

