// Flying by hand: a gamepad or the keyboard becomes sticks, sent fifty times a second while it is switched on.

const sticks = { isKeyboard: false, isGamepad: false, arm: false, kill: false, sent: 0, mode: 'poshold', keys: new Set(), now: { roll: 0, pitch: 0, yaw: 0, throttle: 0 }, buttons: [] };
const KEYS = {
  KeyW: ['throttle', 1], KeyS: ['throttle', -1], KeyD: ['yaw', 1], KeyA: ['yaw', -1],
  ArrowUp: ['pitch', 1], ArrowDown: ['pitch', -1], ArrowRight: ['roll', 1], ArrowLeft: ['roll', -1],
};
const GENTLE = 0.5; // A key's deflection; with Shift all of it.
const STEP = 0.05; // Per 20 ms: a key's stick is out in two tenths of a second.
const DEAD = 0.06;
const SEEN = 10; // Frames with the switch off before it may be on: a vehicle arms only when it sees it thrown.

const isTyping = (event) => event.target.closest?.('input, select, textarea, [contenteditable]');

/** A stick of a gamepad, without the play around its middle. */
const deflection = (value) => (Math.abs(value) < DEAD ? 0 : clamp((value - Math.sign(value) * DEAD) / (1 - DEAD), -1, 1));

const readGamepad = () => {
  const pad = [...navigator.getGamepads()].find((one) => one && one.connected && one.axes.length >= 4);
  if (!pad) return null;
  const pressed = pad.buttons.map((button) => button.pressed);
  const edge = (index) => pressed[index] && !sticks.buttons[index];
  if (edge(9)) sticks.arm = !sticks.arm;
  if (edge(1)) kill();
  if (edge(4)) nextMode(-1);
  if (edge(5)) nextMode(1);
  sticks.buttons = pressed;
  const [yaw, down, roll, back] = pad.axes.map(deflection);
  return { roll, pitch: -back, yaw, throttle: -down };
};

const nextMode = (by) => {
  const select = element('stick-mode');
  select.selectedIndex = clamp(select.selectedIndex + by, 0, select.options.length - 1);
  sticks.mode = select.value;
};

const readKeys = () => {
  const wanted = { roll: 0, pitch: 0, yaw: 0, throttle: 0 };
  const size = sticks.keys.has('Shift') ? 1 : GENTLE;
  for (const [code, [stick, way]] of Object.entries(KEYS)) if (sticks.keys.has(code)) wanted[stick] += way * size;
  for (const stick of Object.keys(wanted)) {
    const now = sticks.now[stick];
    // Let go, a stick springs back at once.
    wanted[stick] = wanted[stick] === 0 ? 0 : clamp(wanted[stick], now - STEP, now + STEP);
  }
  return wanted;
};

const tickSticks = () => {
  const vehicle = live();
  if (!(sticks.isKeyboard || sticks.isGamepad || played.isPlaying) || !vehicle) return;
  if (played.isPlaying) { sendStickFile(vehicle); return; }
  const pad = sticks.isGamepad ? readGamepad() : null;
  const isLost = sticks.isGamepad && !sticks.isKeyboard && !pad;
  setText(element('pad-state'), sticks.isGamepad ? (pad ? 'gamepad heard' : 'press a button of the gamepad') : '');
  // Without a gamepad nothing is sent: the vehicle finds its link lost and lands.
  if (isLost) return;
  const keys = readKeys();
  sticks.now = pad && Object.values(keys).every((value) => value === 0) ? pad : keys;
  const round = (value) => Math.round(value * 1000) / 1000;
  const { roll, pitch, yaw, throttle } = sticks.now;
  say(vehicle.number, {
    do: 'sticks', roll: round(roll), pitch: round(pitch), yaw: round(yaw), throttle: round(throttle),
    mode: sticks.mode, arm: sticks.arm && !sticks.kill && sticks.sent > SEEN, kill: sticks.kill,
  });
  sticks.sent++;
  if (sticks.kill) sticks.arm = false;
};

/** A frame of the stick file. The kill switch of the page ends it. */
const sendStickFile = (vehicle) => {
  const frame = sticks.kill ? null : nextStickFrame(vehicle);
  if (!frame) { stopStickFile(); return; }
  const { roll, pitch, yaw, throttle, mode, arm, kill } = frame;
  sticks.now = { roll, pitch, yaw, throttle };
  say(vehicle.number, { do: 'sticks', roll, pitch, yaw, throttle, mode, arm: arm && !kill && sticks.sent > SEEN, kill });
  Object.assign(sticks, { sent: sticks.sent + 1, arm, mode });
};

const drawSticks = () => {
  if (element('sticks-left').closest('[hidden]')) return;
  const pairs = [['sticks-left', sticks.now.yaw, sticks.now.throttle], ['sticks-right', sticks.now.roll, sticks.now.pitch]];
  for (const [id, right, up] of pairs) {
    const { context, width, height } = prepare(element(id));
    context.strokeStyle = color('--line');
    strokePoints(context, [[width / 2, 4], [width / 2, height - 4]]);
    strokePoints(context, [[4, height / 2], [width - 4, height / 2]]);
    context.fillStyle = color(sticks.isKeyboard || sticks.isGamepad || played.isPlaying ? '--accent' : '--dim');
    context.beginPath();
    context.arc(width / 2 + right * (width / 2 - 12), height / 2 - up * (height / 2 - 12), 8, 0, 2 * Math.PI);
    context.fill();
  }
  element('stick-arm').setAttribute('aria-pressed', sticks.arm);
};

/** Lets go: the sticks of one vehicle are not those of the next. */
const dropSticks = () => {
  Object.assign(sticks, { isKeyboard: false, isGamepad: false, arm: false, kill: false, sent: 0, now: { roll: 0, pitch: 0, yaw: 0, throttle: 0 } });
  sticks.keys.clear();
  stopStickFile();
  for (const id of ['by-keyboard', 'by-gamepad']) element(id).setAttribute('aria-pressed', false);
};

/** The first of both is switched on or off: the arm switch begins off. Not while the other one flies. */
const beginSticks = () => {
  sticks.kill = false;
  stopStickFile();
  if (!sticks.isKeyboard && !sticks.isGamepad) Object.assign(sticks, { arm: false, sent: 0 });
};

const buildSticks = () => {
  element('by-keyboard').addEventListener('click', (event) => toggle(event.currentTarget, (pressed) => {
    beginSticks();
    sticks.isKeyboard = pressed;
    sticks.keys.clear();
    if (pressed) canvas.focus();
  }));
  element('by-gamepad').addEventListener('click', (event) => toggle(event.currentTarget, (pressed) => {
    beginSticks();
    sticks.isGamepad = pressed;
  }));
  element('stick-arm').addEventListener('click', () => { sticks.arm = !sticks.arm; sticks.kill = false; });
  element('stick-mode').addEventListener('change', (event) => { sticks.mode = event.target.value; });
  document.addEventListener('keydown', (event) => {
    if (!sticks.isKeyboard || isTyping(event)) return;
    if (event.key === 'Shift') sticks.keys.add('Shift');
    if (event.code === 'KeyE' && !event.repeat) { sticks.arm = !sticks.arm; sticks.kill = false; }
    if (!KEYS[event.code]) return;
    event.preventDefault();
    sticks.keys.add(event.code);
  });
  document.addEventListener('keyup', (event) => {
    sticks.keys.delete(event.code);
    if (event.key === 'Shift') sticks.keys.delete('Shift');
  });
  // Keys whose release this window would not see are let go.
  window.addEventListener('blur', () => sticks.keys.clear());
  document.addEventListener('visibilitychange', () => sticks.keys.clear());
  setInterval(tickSticks, 20);
};

