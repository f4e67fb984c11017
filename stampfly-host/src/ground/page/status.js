// State, phase, reasons against arming and alerts of the chosen vehicle, in words.

const PHASES = {
  Init: 'starting', IdleGround: 'on the ground', IdleHeld: 'in a hand', Armed: 'armed', TakeOff: 'taking off', Flying: 'flying',
  Landing: 'landing', Flip: 'flipping',
};
const MODES = { Acro: 'acro', Stabilize: 'stabilize', AltHold: 'altitude hold', PosHold: 'position hold' };
const plain = (name) => name.replace(/([a-z])([A-Z])/g, '$1 $2').replaceAll('_', ' ').toLowerCase();
let words = { alerts: {}, blocks: {} };

/** Puts texts into a list without touching it when nothing changes: a screen reader would read it again. */
const setList = (node, texts, className = '') => {
  const key = JSON.stringify(texts);
  if (node.dataset.key === key) return;
  node.dataset.key = key;
  node.replaceChildren();
  for (const text of texts) make('li', node, className, text);
};
const setText = (node, text) => { if (node.textContent !== text) node.textContent = text; };

const isArmed = (vehicle) => Boolean(vehicle && field(vehicle, 'flight_status', 'armed')?.[0]);
const phaseOf = (vehicle) => named(vehicle, 'flight_status', 'phase');

/** Why what is shown of a vehicle is not how it is now; empty when it is. */
const whyOld = (vehicle) => {
  if (!vehicle || vehicle.isLog) return '';
  if (watchesLink && !isHeard()) return 'Nothing is heard of the server';
  if (vehicle.ended) return '';
  // A simulated vehicle's time may stand. A real one's does not.
  const stands = !vehicle.card.offers.includes('speed') && performance.now() - vehicle.moved > OLD;
  return vehicle.away || stands ? 'Nothing is heard of the vehicle' : '';
};

let old = '';
/** Shows that what is shown is old, and lets nothing be asked meanwhile; called several times a second. */
const writeOld = () => {
  const vehicle = selected();
  const why = whyOld(vehicle);
  if (watchesLink && (why !== '') !== (old !== '')) writeLink();
  if (why === old) return;
  old = why;
  document.body.classList.toggle('old', why !== '');
  setText(element('old-why'), why);
  element('old').hidden = why === '';
  if (vehicle) offer(vehicle);
};

/** Who commands, in words. */
const commanderOf = (vehicle) => {
  const source = named(vehicle, 'flight_status', 'commander') ?? 'None';
  const { who = '', page = null } = vehicle.commander ?? {};
  const program = !watchesLink || (page !== null && page === link.page) ? 'this page' : who;
  if (source === 'Guided') return program ? `flown by ${program}` : 'none commands';
  if (source !== 'None') return `flown by ${plain(source)}`;
  return page === null ? '' : `${program} commands`;
};

const writeStatus = (vehicle) => {
  const isOld = whyOld(vehicle) !== '';
  const [phase, mode] = [phaseOf(vehicle), named(vehicle, 'flight_status', 'mode')];
  setText(element('phase'), vehicle.ended ? 'flight over' : isOld ? 'not heard' : phase ? (PHASES[phase] ?? plain(phase)) : 'no state yet');
  element('phase').classList.toggle('bad', isOld);
  setText(element('armed'), phase === null || isOld ? '' : isArmed(vehicle) ? 'ARMED' : 'disarmed');
  element('armed').className = isArmed(vehicle) ? 'chip armed' : 'chip';
  setText(element('mode'), mode ? MODES[mode] ?? plain(mode) : '');
  // What comes next stands out.
  const next = vehicle.isLog || isOld ? '' : !isArmed(vehicle) ? 'arm' : phase === 'Armed' ? 'take-off' : 'land';
  for (const id of ['arm', 'take-off', 'land']) element(id).classList.toggle('main', id === next);
  setText(element('commander'), isOld ? '' : commanderOf(vehicle));
  const blocks = named(vehicle, 'flight_status', 'blocks') ?? [];
  const isIdle = !isArmed(vehicle) && phase !== null && !isOld;
  setList(element('blocks'), isIdle ? blocks.map((name) => words.blocks[name] ?? plain(name)) : []);
  element('ready').hidden = !(isIdle && blocks.length === 0 && !vehicle.isLog);
  element('blocked').hidden = !(isIdle && blocks.length > 0);
  const alerts = vehicle.card.page.alerts ? named(vehicle, ...vehicle.card.page.alerts) ?? [] : [];
  setList(element('alerts'), alerts.map((name) => words.alerts[name] ?? plain(name)));
  element('alarm').hidden = alerts.length === 0;
  const { main } = observersOf(vehicle.card);
  const pose = poseOf(vehicle, main);
  const velocity = field(vehicle, main?.topic, 'velocity');
  const [roll, pitch, yaw] = pose ? rollPitchYaw(pose.attitude).map((angle) => angle * DEGREES) : [NaN, NaN, NaN];
  const voltage = column(vehicle, 'sensor_power', 'voltage')(), current = column(vehicle, 'sensor_power', 'current')();
  const figures = {
    height: [pose ? -pose.place[2] : NaN, 2], north: [pose?.place[0] ?? NaN, 2], east: [pose?.place[1] ?? NaN, 2],
    speed: [velocity ? Math.hypot(...velocity) : NaN, 2], roll: [roll, 1], pitch: [pitch, 1], heading: [Math.round(yaw + 360) % 360, 0],
    voltage: [voltage, 2], current: [current, 2],
  };
  for (const [name, [value, digits]] of Object.entries(figures)) setText(element(`figure-${name}`), number(value, digits));
  setText(element('clock'), Number.isFinite(vehicle.clock) ? `${vehicle.clock.toFixed(1)} s` : '–');
};

const writeLink = () => {
  const node = element('link');
  node.className = !isHeard() ? 'chip bad' : link.rate < RATE * 0.7 ? 'chip weak' : 'chip good';
  const parts = [isHeard() ? `${Math.round(link.rate)} Hz` : 'silent'];
  if (Number.isFinite(link.delay)) parts.push(`${Math.round(link.delay)} ms`);
  if (link.dropped) parts.push(`${link.dropped} dropped`);
  setText(node, link.isOpen ? parts.join(' · ') : 'not connected');
  node.title = 'Texts a second from the server, the time of the last answer, texts left out because this page was too slow';
};

/** What the vehicle and the server say, newest first. */
const log = (text, kind = '') => {
  const list = element('messages');
  const item = document.createElement('li');
  item.className = kind;
  make('time', item, '', new Date().toLocaleTimeString());
  make('span', item, '', text);
  list.prepend(item);
  while (list.children.length > 100) list.lastChild.remove();
  if (kind === 'bad') setText(element('toast'), text);
};

