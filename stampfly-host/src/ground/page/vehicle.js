// A vehicle as the page sees it, live or from a log: the newest sample of each topic, and frames of the past.

/** Where the fields of a topic lie among its numbers. */
const layout = (fields) => {
  const places = new Map();
  let start = 0;
  for (const field of fields) {
    places.set(field.name, { ...field, start });
    start += field.count;
  }
  return places;
};

const KEPT = 6000; // Frames of a live vehicle: two minutes at 50 Hz.

const makeVehicle = (card, number) => {
  const topics = new Map(card.topics.map((topic) => [topic.name, {
    ...topic, places: layout(topic.fields), at: 0, count: 0, values: null, rate: 0,
  }]));
  const vehicle = { card, number, topics, list: [...topics.values()], clock: 0, times: [], columns: new Map(), goal: null, ended: '', away: '', moved: performance.now(), commander: card.commander };
  vehicle.plots = plotsOf(vehicle);
  for (const getter of Object.entries(motionOf(vehicle))) vehicle.columns.set(getter[0], { get: getter[1], values: [] });
  for (const plot of vehicle.plots) for (const line of plot.lines) vehicle.columns.set(line.key, { get: line.get, values: [] });
  return vehicle;
};

/** The newest number of a column such as `duty[2]`; NaN where there is none. */
const column = (vehicle, topic, name) => {
  const known = vehicle.topics.get(topic);
  const match = /^(.*?)(?:\[(\d+)\])?$/.exec(name);
  const field = known?.places.get(match[1]);
  if (!field) return () => NaN;
  const place = field.start + Number(match[2] ?? 0);
  return () => known.values?.[place] ?? NaN;
};

/** Fields by name, as numbers; null before the first sample. */
const field = (vehicle, topic, name) => {
  const known = vehicle.topics.get(topic);
  const place = known?.places.get(name);
  if (!place || !known.values) return null;
  return known.values.slice(place.start, place.start + place.count);
};

/** The name of an enumeration's value, or the names of flags that are set. */
const named = (vehicle, topic, name) => {
  const place = vehicle.topics.get(topic)?.places.get(name);
  const value = field(vehicle, topic, name)?.[0];
  if (!place || value === undefined || value === null) return null;
  if (place.kind === 'flags') return place.names.filter(([, mask]) => (value & mask) !== 0).map(([flag]) => flag);
  return place.names.find(([, code]) => code === value)?.[0] ?? String(value);
};

const DEGREES = 180 / Math.PI;
const rollPitchYaw = ([w, x, y, z]) => [
  Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
  Math.asin(clamp(2 * (w * y - z * x), -1, 1)),
  Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
];

/** Who says where the vehicle is: the main one, and the truth where there is one. */
const observersOf = (card) => {
  const has = (observer) => card.topics.some((topic) => topic.name === observer.topic);
  const observers = card.page.observers.filter(has);
  return { main: observers[0], truth: observers.find((observer) => observer.role === 'truth' && observer !== observers[0]) };
};

/** Place and attitude of an observer now: NED and quaternion; null before the first sample. */
const poseOf = (vehicle, observer) => {
  if (!observer) return null;
  if (observer.plane) {
    const [x, y, yaw] = ['x', 'y', 'yaw'].map((name) => field(vehicle, observer.topic, name)?.[0] ?? NaN);
    // Left and counter-clockwise are positive there, right and clockwise here.
    return Number.isFinite(x + y + yaw) ? { place: [x, -y, 0], attitude: [Math.cos(yaw / 2), 0, 0, -Math.sin(yaw / 2)] } : null;
  }
  const place = field(vehicle, observer.topic, 'position'), attitude = field(vehicle, observer.topic, 'attitude');
  return place && attitude && [...place, ...attitude].every(Number.isFinite) ? { place, attitude } : null;
};

/** Columns that the view in space needs. */
const motionOf = (vehicle) => {
  const { main, truth } = observersOf(vehicle.card);
  const axis = (observer, index) => () => poseOf(vehicle, observer)?.place[index] ?? NaN;
  const columns = {};
  for (const [name, observer] of [['main', main], ['truth', truth]]) {
    if (observer) for (const index of [0, 1, 2]) columns[`${name}.${index}`] = axis(observer, index);
  }
  return columns;
};

/** The plots of a vehicle: height and attitude where it moves in space, then of its own page what matters in flight. */
const plotsOf = (vehicle) => {
  const { card } = vehicle;
  const { main, truth } = observersOf(card);
  const plots = [];
  if (main && !main.plane) {
    const height = (observer) => () => -(field(vehicle, observer.topic, 'position')?.[2] ?? NaN);
    const lines = [{ name: 'estimate', role: 'estimate', get: height(main) }];
    if (truth) lines.push({ name: 'truth', role: 'truth', get: height(truth) });
    const setpoint = card.page.setpoint;
    if (vehicle.topics.get(setpoint)) {
      const get = () => (named(vehicle, setpoint, 'axes')?.includes('POSITION_Z') ? -field(vehicle, setpoint, 'position')[2] : NaN);
      lines.push({ name: 'set-point', role: 'setpoint', get });
    }
    plots.push({ title: 'Height', unit: 'm', least: 0.4, lines });
    const angle = (index) => () => {
      const attitude = field(vehicle, main.topic, 'attitude');
      return attitude ? rollPitchYaw(attitude)[index] * DEGREES : NaN;
    };
    // Not yaw: its turns would leave nothing to see of the others.
    const angles = ['roll', 'pitch'].map((name, index) => ({ name, role: index, get: angle(index) }));
    plots.push({ title: 'Attitude', unit: '°', least: 10, lines: angles });
  }
  const wanted = ['Voltage', 'Motor duty'];
  const panels = card.page.panels.filter((panel) => wanted.includes(panel.title));
  for (const panel of panels.length ? panels : card.page.panels.slice(0, 4)) {
    const lines = panel.lines.map(([name, title], role) => {
      const get = column(vehicle, panel.topic, name);
      return { name: title, role, get: () => get() * panel.factor };
    });
    plots.push({ title: panel.title, unit: panel.unit, least: { V: 0.2, '%': 10 }[panel.unit] ?? 0, lines });
  }
  plots.forEach((plot, index) => plot.lines.forEach((line) => { line.key = `${index}.${line.name}`; }));
  return plots;
};

/** Topics that the page shows of a vehicle. */
const topicsOf = (card) => [...new Set([
  ...card.page.observers.map((observer) => observer.topic), card.page.setpoint, card.page.alerts?.[0],
  ...card.page.bands.map(([topic]) => topic),
  ...card.page.panels.filter((panel) => ['Voltage', 'Motor duty'].includes(panel.title)).map((panel) => panel.topic),
  'sensor_power', 'flight_status', 'arm_refusals', 'estimate_status', 'calibration_report',
])].filter((name) => card.topics.some((topic) => topic.name === name));

/** Keeps a frame of now. */
const keepFrame = (vehicle, limit = KEPT) => {
  const { times } = vehicle;
  const last = times[times.length - 1];
  if (vehicle.clock === last) return;
  times.push(vehicle.clock);
  for (const kept of vehicle.columns.values()) kept.values.push(kept.get());
  if (times.length > limit * 1.2) {
    const extra = times.length - limit;
    times.splice(0, extra);
    for (const kept of vehicle.columns.values()) kept.values.splice(0, extra);
  }
};

/** The clock went back: another flight has begun. */
const forget = (vehicle) => {
  vehicle.times.length = 0;
  for (const topic of vehicle.list) topic.values = null;
  for (const kept of vehicle.columns.values()) kept.values.length = 0;
};

/** How many frames are not after a time. */
const framesUntil = (vehicle, time) => {
  let low = 0, high = vehicle.times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (vehicle.times[middle] <= time) low = middle + 1; else high = middle;
  }
  return low;
};

