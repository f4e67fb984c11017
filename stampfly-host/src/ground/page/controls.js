// Buttons that fly: arm, take off, land, hold, kill, go there, flip; the speed of time.

const live = () => {
  const vehicle = selected();
  return vehicle && !vehicle.isLog ? vehicle : null;
};

/** Asks the chosen vehicle; a refusal is shown. */
const command = async (what, title) => {
  const vehicle = live();
  if (!vehicle) { log('this is a recorded flight: nothing can be asked of it', 'bad'); return { ok: false }; }
  const reply = await ask(vehicle.number, what);
  log(`${vehicle.card.name}, ${title}: ${reply.text || (reply.ok ? 'done' : 'refused')}`, reply.ok ? '' : 'bad');
  return reply;
};
const guided = (kind, title, more = {}) => command({ do: 'guided', kind, ...more }, title);

const inputNumber = (id) => {
  const node = element(id);
  return node.value.trim() !== '' && node.checkValidity() ? Number(node.value) : NaN;
};

/** The chosen vehicle, also while a log is in front of it. */
const kill = async () => {
  const vehicle = station.vehicles[station.chosen];
  if (!vehicle) return;
  sticks.kill = true;
  const reply = await ask(vehicle.number, { do: 'guided', kind: 'kill' });
  log(`${vehicle.card.name}, KILL${reply.ok ? '' : `: ${reply.text}`}`, 'bad');
};

const killAll = () => {
  sticks.kill = true;
  for (const { number } of station.vehicles) ask(number, { do: 'guided', kind: 'kill' });
  log('KILL, all vehicles', 'bad');
};

const goTo = async (north, east, up) => {
  const vehicle = live();
  if (!vehicle) return;
  if (![north, east, up].every(Number.isFinite)) { log('north, east and height have to be numbers', 'bad'); return; }
  const pose = poseOf(vehicle, observersOf(vehicle.card).main);
  const yaw = pose ? rollPitchYaw(pose.attitude)[2] : 0;
  const round = (value) => Math.round(value * 1000) / 1000;
  vehicle.goal = { north: round(north), east: round(east), up };
  const place = `${fixed(north, 2)} m north, ${fixed(east, 2)} m east, ${fixed(up, 2)} m up`;
  const reply = await guided('go_to', `go to ${place}`, { ...vehicle.goal, yaw: round(yaw) });
  if (!reply.ok) vehicle.goal = null;
};
const goByClick = ([north, east]) => {
  const vehicle = live();
  if (!vehicle || element('click-to-go').getAttribute('aria-pressed') !== 'true') return;
  element('goal-north').value = (north - vehicle.card.place[0]).toFixed(2);
  element('goal-east').value = (east - vehicle.card.place[1]).toFixed(2);
  goTo(north - vehicle.card.place[0], east - vehicle.card.place[1], inputNumber('height'));
};

const toggle = (node, set) => {
  const pressed = node.getAttribute('aria-pressed') !== 'true';
  node.setAttribute('aria-pressed', pressed);
  set?.(pressed);
};

const buildControls = () => {
  const click = (id, action) => element(id).addEventListener('click', action);
  click('arm', () => guided('arm', 'arm'));
  click('disarm', () => guided('disarm', 'disarm'));
  click('take-off', () => {
    const height = inputNumber('height');
    if (Number.isFinite(height)) guided('take_off', `take off to ${height} m`, { height });
    else log('the height has to be a number', 'bad');
  });
  click('land', () => { const vehicle = live(); if (vehicle) vehicle.goal = null; guided('land', 'land'); });
  click('hold', () => { const vehicle = live(); if (vehicle) vehicle.goal = null; guided('hold', 'hold'); });
  click('kill', kill);
  click('click-to-go', () => toggle(element('click-to-go')));
  element('goal').addEventListener('submit', (event) => {
    event.preventDefault();
    goTo(inputNumber('goal-north'), inputNumber('goal-east'), inputNumber('height'));
  });
  for (const direction of ['left', 'right', 'forward', 'back']) click(`flip-${direction}`, () => guided('flip', `flip ${direction}`, { direction }));
  click('view-reset', resetCamera);
  click('view-top', () => { camera.tilt = Math.PI / 2; camera.turn = 0; });
  click('view-follow', () => toggle(element('view-follow'), (pressed) => {
    view.follow = pressed;
    if (!pressed) camera.target = home().target;
  }));
  element('speed').addEventListener('change', () => command({ do: 'speed', factor: Number(element('speed').value) }, `time ×${element('speed').value}`));
  document.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape') return;
    event.preventDefault();
    if (event.shiftKey) killAll(); else kill();
  }, { capture: true });
};

/** What a vehicle does not offer, or could not do at once, cannot be pressed, and says why. */
const offer = (vehicle) => {
  for (const node of document.querySelectorAll('[data-needs]')) {
    // Motors are stopped of the vehicle that flies, also while a log is in front of it.
    const asked = node.id === 'kill' ? station.vehicles[station.chosen] ?? vehicle : vehicle;
    const ends = ['kill', 'land'].includes(node.id);
    const offers = !asked.isLog && asked.card.offers.includes(node.dataset.needs);
    const isOld = old !== '' && !ends;
    node.disabled = !offers || isOld;
    node.title = !offers ? (asked.isLog ? 'A recorded flight' : 'Not offered by this vehicle') : isOld ? old : '';
  }
  // What no real vehicle can do is not shown for one.
  for (const node of document.querySelectorAll('[data-only]')) {
    node.hidden = !vehicle.isLog && !vehicle.card.offers.includes(node.dataset.only);
    if (node.hidden && node.getAttribute('aria-selected') === 'true') element('tab-fly').click();
  }
};

