// A stick file: what a person's thumbs did, sent as a gamepad's sticks are. Its rules are those of `stampfly fly --sticks`.

const STICK_COLUMNS = ['t', 'throttle', 'roll', 'pitch', 'yaw', 'mode', 'arm'];
const STICK_SWITCHES = ['flip', 'kill', 'land'];
const STICK_MODES = ['stabilize', 'acro', 'althold', 'poshold'];
const MOST_STICK_BYTES = 16 * 1024 * 1024;
const MOST_STICK_ROWS = 200000;
const LONGEST_STICK_LINE = 1000;
const LATEST_STICKS = 3600;
const LET_GO = 2; // Sticks that were let go stay so for this long before the arm switch is turned off, s.
const LANDS = 60; // And the switch is shown off for this long, or until the vehicle is disarmed, s.

const played = { rows: null, name: '', isPlaying: false, began: NaN, next: 0, held: null, left: NaN };

/** The rows of a stick file. Throws what is wrong with it, and where. */
const readStickFile = (text) => {
  const lines = text.replace(/^\uFEFF/, '').split('\n').map((line, index) => [index + 1, line.replace(/\r$/, '')]);
  const wrong = (line, what) => { throw new Error(`line ${line}: ${what}`); };
  const shown = (field) => (field.length > 24 ? `${field.slice(0, 24)}…` : field);
  const filled = lines.filter(([line, content]) => {
    if (content.length > LONGEST_STICK_LINE) wrong(line, `the line is longer than ${LONGEST_STICK_LINE} bytes`);
    return content.trim() !== '';
  });
  if (filled.length === 0) throw new Error('the file is empty: its first line names the columns');
  const [[head, header], ...rows] = filled;
  const names = header.split(',').map((name) => name.trim());
  names.forEach((name, place) => {
    if (![...STICK_COLUMNS, ...STICK_SWITCHES].includes(name)) wrong(head, `column '${shown(name)}' is unknown`);
    if (names.indexOf(name) !== place) wrong(head, `column ${name} is there twice`);
  });
  for (const name of STICK_COLUMNS) if (!names.includes(name)) wrong(head, `column ${name} is missing`);
  if (rows.length === 0) throw new Error('there is no row below the header');
  if (rows.length > MOST_STICK_ROWS) wrong(rows[MOST_STICK_ROWS][0], `there are more than ${MOST_STICK_ROWS} rows`);
  let before = 0;
  return rows.map(([line, content]) => {
    const fields = content.split(',').map((field) => field.trim());
    if (fields.length !== names.length) wrong(line, `${fields.length} fields, and the header has ${names.length}`);
    const row = { flip: false, kill: false, land: false };
    names.forEach((name, place) => {
      const field = fields[place];
      const value = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(field) ? Number(field) : NaN;
      if (name === 't') {
        if (!(value >= 0 && value <= LATEST_STICKS)) wrong(line, `t: '${shown(field)}' is no number of seconds from 0 to ${LATEST_STICKS}`);
        row.t = value;
      } else if (name === 'mode') {
        if (!STICK_MODES.includes(field)) wrong(line, `mode: '${shown(field)}' is none of ${STICK_MODES.join(', ')}`);
        row.mode = field;
      } else if (name === 'arm' || STICK_SWITCHES.includes(name)) {
        if (field !== '0' && field !== '1') wrong(line, `${name}: '${shown(field)}' is neither 0 nor 1`);
        row[name] = field === '1';
      } else {
        if (!(value >= -1 && value <= 1)) wrong(line, `${name}: '${shown(field)}' is no number from -1 to 1`);
        row[name] = value;
      }
    });
    if (row.t < before) wrong(line, `t: ${row.t} is before the time of the row above`);
    before = row.t;
    return row;
  });
};

const openStickFile = async (file) => {
  try {
    if (file.size > MOST_STICK_BYTES) throw new Error(`the file is larger than ${MOST_STICK_BYTES} bytes`);
    stopStickFile();
    played.rows = readStickFile(await file.text());
    played.name = file.name;
    log(`${file.name}: ${played.rows.at(-1).t.toFixed(1)} s of sticks`);
  } catch (error) {
    played.rows = null;
    log(`${file.name}: ${error.message}`, 'bad');
  }
  setText(element('sticks-state'), played.rows ? `${played.name}, ${played.rows.at(-1).t.toFixed(1)} s` : '');
};

/** Plays the file from its beginning, on the vehicle's clock, in place of keyboard and gamepad. */
const playStickFile = () => {
  const vehicle = live();
  if (!played.rows) { element('sticks-file').click(); return; }
  if (!vehicle || !Number.isFinite(vehicle.clock)) return;
  const { arm, sent } = sticks;
  const goesOn = sticks.isKeyboard || sticks.isGamepad;
  dropSticks();
  // A switch that is on stays on: off and on again it would ask for a landing.
  if (goesOn) Object.assign(sticks, { arm, sent });
  const first = { ...played.rows[0], arm: goesOn && arm, flip: false, kill: false, land: false };
  Object.assign(played, { isPlaying: true, began: vehicle.clock, next: 0, held: first, left: NaN });
};

/** Lets go of the sticks: they are centred in a mode that holds the height, and then the arm switch is turned off, which lands. */
const letGo = (clock) => {
  const { held } = played;
  const mode = ['stabilize', 'acro'].includes(held.mode) ? 'althold' : held.mode;
  Object.assign(played, { left: clock, held: { ...held, mode, throttle: 0, roll: 0, pitch: 0, yaw: 0, flip: false, land: false } });
};

const stopStickFile = () => {
  played.isPlaying = false;
  setText(element('sticks-state'), played.rows ? played.name : '');
};

/** The next frame of the file; null when there is none. */
const nextStickFrame = (vehicle) => {
  const { clock } = vehicle;
  if (Number.isNaN(played.left)) {
    let kill = false;
    for (let row = played.rows[played.next]; row && row.t <= clock - played.began; row = played.rows[played.next]) {
      if (row.flip && !played.held.flip) guided('flip', `flip ${flipOf(row)}`, { direction: flipOf(row) });
      if (row.land && !played.held.land) guided('land', 'land');
      kill ||= row.kill;
      played.held = row;
      played.next++;
    }
    const frame = { ...played.held, kill: kill || played.held.kill };
    setText(element('sticks-state'), `${played.name}: ${(clock - played.began).toFixed(1)} s of ${played.rows.at(-1).t.toFixed(1)} s`);
    if (played.next >= played.rows.length) letGo(clock);
    return frame;
  }
  const since = clock - played.left;
  // Turned off once more in a landing, the switch would stop the motors.
  if (since >= LET_GO && phaseOf(vehicle) !== 'Landing') played.held.arm = false;
  if (since >= LET_GO + LANDS || (since >= LET_GO && !isArmed(vehicle))) { stopStickFile(); return null; }
  setText(element('sticks-state'), `${played.name}: let go, and lands`);
  return played.held;
};

/** The flip that the sticks point to: the farther one of roll and pitch, forward when both are centred. */
const flipOf = ({ roll, pitch }) => {
  if (Math.abs(roll) > 0.2 && Math.abs(roll) > Math.abs(pitch)) return roll > 0 ? 'right' : 'left';
  return pitch < -0.2 ? 'back' : 'forward';
};

const buildStickFile = () => {
  element('sticks-file').addEventListener('change', (event) => { if (event.target.files[0]) openStickFile(event.target.files[0]); event.target.value = ''; });
  element('sticks-open').addEventListener('click', () => element('sticks-file').click());
  element('sticks-play').addEventListener('click', playStickFile);
  element('sticks-stop').addEventListener('click', () => { const vehicle = live(); if (played.isPlaying && vehicle) letGo(vehicle.clock); });
};

