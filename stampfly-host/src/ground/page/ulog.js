// A ULog file as a vehicle: its topics, the sample of each at a time, frames of the whole flight.

const MAGIC = [0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35];
const TYPES = {
  int8_t: [1, 'getInt8'], uint8_t: [1, 'getUint8'], bool: [1, 'getUint8'], char: [1, 'getUint8'], int16_t: [2, 'getInt16'],
  uint16_t: [2, 'getUint16'], int32_t: [4, 'getInt32'], uint32_t: [4, 'getUint32'], float: [4, 'getFloat32'],
  double: [8, 'getFloat64'], int64_t: [8, 'getBigInt64'], uint64_t: [8, 'getBigUint64'],
};

/** Reads a file. Throws an Error whose message is for people. */
const readLog = (buffer) => {
  const bytes = new Uint8Array(buffer), view = new DataView(buffer);
  if (bytes.length < 16 || MAGIC.some((byte, index) => bytes[index] !== byte)) throw new Error('this is no ULog file');
  const text = (from, to) => new TextDecoder().decode(bytes.subarray(from, to));
  const log = { formats: new Map(), topics: new Map(), info: new Map(), parameters: [], texts: [], damaged: 0, view };
  const micros = (place) => (view.getUint32(place, true) + view.getUint32(place + 4, true) * 2 ** 32) * 1e-6;
  const byId = new Map();
  let at = 16;
  while (at + 3 <= bytes.length) {
    const size = view.getUint16(at, true), kind = String.fromCharCode(bytes[at + 2]);
    const from = at + 3, to = from + size;
    if (to > bytes.length) break; // Cut off by a crash: the rest is still worth reading.
    at = to;
    if (kind === 'F') {
      const [name, fields = ''] = text(from, to).split(':');
      log.formats.set(name, fields.split(';').filter(Boolean));
    } else if (kind === 'I' || kind === 'P') {
      const key = text(from + 1, from + 1 + bytes[from]), value = from + 1 + bytes[from];
      const [type, name] = [key.slice(0, key.indexOf(' ')), key.slice(key.indexOf(' ') + 1)];
      if (type.startsWith('char')) log.info.set(name, text(value, to));
      else if (TYPES[type]) {
        const number = Number(view[TYPES[type][1]](value, true));
        if (kind === 'P') log.parameters.push([name, number]); else log.info.set(name, number);
      }
    } else if (kind === 'A') {
      const format = text(from + 3, to), multi = bytes[from];
      const topic = { format, name: multi ? `${format}_${multi}` : format, times: [], offsets: [] };
      byId.set(view.getUint16(from + 1, true), topic);
      // Which runnable ran when is half of a log, and for a replay alone.
      topic.isSkipped = format.startsWith('activation_');
      if (!topic.isSkipped && !log.topics.has(topic.name)) log.topics.set(topic.name, topic);
    } else if (kind === 'D') {
      const topic = byId.get(view.getUint16(from, true));
      if (topic?.isSkipped) continue;
      if (!topic || size < 10) { log.damaged++; continue; }
      topic.times.push(micros(from + 2));
      topic.offsets.push(from + 2);
      topic.size = size - 2;
    } else if (kind === 'L') {
      log.texts.push([micros(from + 1), text(from + 9, to)]);
    }
  }
  for (const topic of log.topics.values()) topic.fields = fieldsOf(log, topic);
  return log;
};

/** The fields of a topic with their places in a sample; names and units as the log's infos say. */
const fieldsOf = (log, topic) => {
  const units = new Map((log.info.get(`units/${topic.format}`) ?? '').split(' ').map((part) => part.split('=')));
  const fields = [];
  let offset = 0;
  for (const text of log.formats.get(topic.format) ?? []) {
    const [, type, count, name] = /^(\w+)(?:\[(\d+)\])? (\w+)$/.exec(text) ?? [];
    if (!TYPES[type]) break; // A format within a format: none of ours has one.
    const names = (log.info.get(`names/${topic.format}/${name}`) ?? '').split(' ').filter(Boolean).map((part) => part.split('='))
      .map(([word, code]) => [word, Number(code)]);
    fields.push({ name, type, count: Number(count ?? 1), offset, unit: units.get(name) ?? '', names });
    offset += TYPES[type][0] * Number(count ?? 1);
  }
  return fields.filter(({ name }) => name !== 'timestamp' && !name.startsWith('_padding'));
};

/** What a vehicle's card says, from a log. What the page shows of it is a known card's of the same kind, or any. */
const cardOfLog = (log, title, cards) => {
  const kind = log.info.get('sys_name') ?? '';
  const known = cards.find((card) => card.kind === kind) ?? cards[0];
  const topics = [...log.topics.values()].map(({ name, fields }) => ({
    name, doc: '', rate: '',
    fields: fields.map((entry) => {
      const same = known?.topics.find((topic) => topic.name === name)?.fields.find((other) => other.name === entry.name);
      const kind = same?.kind ?? (entry.names.length ? 'enum' : 'number');
      return { name: entry.name, unit: entry.unit, count: entry.count, kind, names: entry.names };
    }),
  }));
  const parameters = log.parameters.map(([name, value]) => {
    const same = known?.parameters.find((parameter) => parameter.name === name);
    return { name, value, unit: same?.unit ?? '', meaning: same?.meaning ?? '', default: same?.default ?? value, range: same?.range ?? null };
  });
  return { ...known, name: title, kind, topics, parameters, faults: [], missions: [], offers: [], calibrations: [], place: [0, 0] };
};

/** The vehicle of a log. `vehicle.seek(time)` makes it what it was then. */
const vehicleOfLog = (log, title, cards) => {
  const used = [...log.topics.values()].filter((topic) => topic.times.length && topic.fields.length);
  const vehicle = makeVehicle(cardOfLog(log, title, cards), -1);
  const shown = used.filter((topic) => topicsOf(vehicle.card).includes(topic.name));
  const spans = (shown.length ? shown : used).map((topic) => [topic.times[0], topic.times[topic.times.length - 1]]);
  if (!spans.length) throw new Error('this log has no samples');
  vehicle.start = Math.min(...spans.map(([from]) => from));
  vehicle.end = Math.max(...spans.map(([, to]) => to));
  vehicle.isLog = true;
  const decode = (topic, offset) => {
    const values = [];
    for (const { type, count, offset: place } of topic.fields) {
      const [size, get] = TYPES[type];
      for (let index = 0; index < count; index++) {
        const here = place + index * size;
        values.push(here + size <= topic.size ? Number(log.view[get](offset + here, true)) : NaN);
      }
    }
    return values;
  };
  vehicle.seek = (time, isQuick = false) => {
    vehicle.clock = time;
    for (const topic of isQuick || !topicsAreShown() ? shown : used) {
      const entry = vehicle.topics.get(topic.name);
      let low = 0, high = topic.times.length;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (topic.times[middle] <= time) low = middle + 1; else high = middle;
      }
      entry.count = low;
      entry.at = low ? topic.times[low - 1] : 0;
      if (!low) entry.values = null;
      else if (entry.decoded !== low) entry.values = decode(topic, topic.offsets[low - 1]);
      entry.decoded = low;
    }
  };
  const step = Math.max(0.02, (vehicle.end - vehicle.start) / 20000);
  for (let time = vehicle.start; time <= vehicle.end; time += step) {
    vehicle.seek(time, true);
    keepFrame(vehicle, Infinity);
  }
  vehicle.seek(vehicle.start);
  return vehicle;
};

