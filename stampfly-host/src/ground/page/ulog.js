// A ULog file as a vehicle: its topics, the sample of each at a time, frames of the whole flight.
//
// What is whole, where reading goes on behind damage, how formats within formats are named and how
// much of a file may be laid out are as in `stampfly_log::ulog` and `stampfly_host::flight_log`, and
// so is the sentence that says how far a log is whole.

const MAGIC = [0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35];
const SYNC_MARK = [8, 0, 0x53, 0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
const TYPES = {
  int8_t: [1, 'getInt8'], uint8_t: [1, 'getUint8'], bool: [1, 'getUint8'], char: [1, 'getUint8'], int16_t: [2, 'getInt16'],
  uint16_t: [2, 'getUint16'], int32_t: [4, 'getInt32'], uint32_t: [4, 'getUint32'], float: [4, 'getFloat32'],
  double: [8, 'getFloat64'], int64_t: [8, 'getBigInt64'], uint64_t: [8, 'getBigUint64'],
};
// A small file may claim much: topics, numbers and fields of all topics, steps to lay them out,
// formats within one another, letters.
const MOST = { topics: 4096, columns: 65536, fields: 16384, steps: 1 << 20, stepsOfOne: 65536, depth: 6, name: 255, sample: 65535 };

/** Where messages are, one by one; `end` says how far the file is whole. */
const messagesOf = function* (bytes, view, end) {
  let appended = [];
  const partEnd = (at) => (appended.length ? Math.min(bytes.length, ...appended.filter((offset) => offset > at)) : bytes.length);
  const findMark = (from, to) => {
    // The byte in the mark that is rarest in logs.
    for (let at = bytes.indexOf(0xbb, from + 9); at >= 0 && at + 2 <= to; at = bytes.indexOf(0xbb, at + 1)) {
      if (SYNC_MARK.every((byte, index) => bytes[at - 9 + index] === byte)) return at - 9;
    }
    return -1;
  };
  const isType = (byte) => (byte >= 48 && byte < 58) || (byte >= 65 && byte < 91) || (byte >= 97 && byte < 123);
  const skip = (at, to, isCut) => {
    if (!end.places && isCut && to === bytes.length) end.isCut = true;
    if (!end.places) end.at = at;
    end.places++;
    end.skipped += to - at;
  };
  let at = 16;
  while (at < bytes.length) {
    const stop = partEnd(at), from = at + 3;
    const size = from <= stop ? view.getUint16(at, true) : 0, to = from + size;
    const isCut = to > stop || (size >= 256 && findMark(from, to) >= 0);
    // A message that no message follows may be missing bytes.
    if (isCut || !isType(bytes[at + 2]) || (to + 3 <= stop && !isType(bytes[to + 2]) && ![0x42, 0x53].includes(bytes[at + 2]))) {
      const mark = findMark(at + 1, stop), next = mark < 0 ? stop : mark;
      skip(at, next, isCut);
      at = next;
      continue;
    }
    const message = parseMessage(String.fromCharCode(bytes[at + 2]), bytes, view, from, to);
    if (!message) skip(at, to, false);
    else if (message.appended && at === 16) {
      if (message.isUnreadable) throw new Error('the log needs features that are not known');
      appended = message.appended;
    }
    at = to;
    if (message) yield message;
  }
};

const UTF8 = new TextDecoder('utf-8', { fatal: true, ignoreBOM: true });
const readMicros = (view, place) => (view.getUint32(place, true) + view.getUint32(place + 4, true) * 2 ** 32) * 1e-6;

/** `type name` or `type[count] name`; null where it is neither. */
const parseDeclaration = (text) => {
  const trimmed = text.trim(), space = trimmed.indexOf(' '), open = trimmed.indexOf('[');
  const isArray = open >= 0 && open < space;
  const type = trimmed.slice(0, isArray ? open : Math.max(space, 0)), name = trimmed.slice(space).trim();
  const count = isArray ? trimmed.slice(open + 1, space - 1) : '0';
  if (space < 0 || !type || !name || !/^\d{1,20}$/.test(count) || (isArray && trimmed[space - 1] !== ']')) return null;
  return { type, count: isArray ? Number(count) : undefined, name };
};

/** What a message says; null where it is not what its type promises. */
const parseMessage = (kind, bytes, view, from, to) => {
  const has = (size) => to - from >= size;
  const text = (at) => UTF8.decode(bytes.subarray(at, to));
  const keyed = (at) => {
    const value = at + 1 + bytes[at];
    if (at >= to || value > to) return null;
    const key = parseDeclaration(UTF8.decode(bytes.subarray(at + 1, value)));
    return key && { ...key, value, to };
  };
  try {
    switch (kind) {
      case 'D': return has(2) ? { kind, id: view.getUint16(from, true), from: from + 2, to } : null;
      case 'B': {
        if (!has(40)) return null;
        const [first, ...others] = bytes.subarray(from + 8, from + 16);
        const places = [0, 1, 2].map((index) => Number(view.getBigUint64(from + 16 + 8 * index, true)));
        return { kind, isUnreadable: (first & ~1) !== 0 || others.some(Boolean), appended: first & 1 ? places : [] };
      }
      case 'F': {
        const [name, ...fields] = text(from).split(':');
        return fields.length ? { kind, name, fields: fields.join(':') } : null;
      }
      case 'I': { const key = keyed(from); return key && { kind, ...key }; }
      case 'M': { const key = has(1) && keyed(from + 1); return key ? { kind, ...key } : null; }
      case 'P': case 'Q': {
        const key = keyed(kind === 'Q' ? from + 1 : from);
        return key && key.value + 4 <= to && ['float', 'int32_t'].includes(key.type) ? { kind, ...key } : null;
      }
      case 'A': return has(3) ? { kind, instance: bytes[from], id: view.getUint16(from + 1, true), topic: text(from + 3) } : null;
      case 'R': case 'O': return has(2) ? { kind } : null;
      case 'L': case 'C': {
        const place = from + (kind === 'C' ? 3 : 1), level = bytes[from];
        if (!(place + 8 <= to && (level < 8 || (level >= 48 && level < 56)))) return null;
        return { kind, at: readMicros(view, place), text: text(place + 8) };
      }
      case 'S': return to - from === 8 && SYNC_MARK.slice(3).every((byte, index) => bytes[from + index] === byte) ? { kind } : null;
      default: return { kind };
    }
  } catch {
    return null; // Not UTF-8.
  }
};

/** How far a log is whole, in the words of the program. */
const sayEnd = ({ at, places, skipped, isCut }) => {
  if (isCut) return `cut off at byte ${at}: the last ${skipped} bytes are no whole message`;
  const more = places > 1 ? ` and in ${places - 1} places more` : '';
  return places ? `damaged at byte ${at}${more}: ${skipped} bytes were passed over` : 'whole';
};

/** Reads a file. Throws an Error whose message is for people. */
const readLog = (buffer) => {
  const bytes = new Uint8Array(buffer), view = new DataView(buffer);
  if (bytes.length < 16 || MAGIC.some((byte, index) => bytes[index] !== byte)) throw new Error('this is no ULog file');
  const end = { at: 0, places: 0, skipped: 0, isCut: false };
  const log = { formats: new Map(), topics: new Map(), info: new Map(), parameters: [], texts: [], omissions: [], left: { ...MOST }, short: 0, end, view };
  const started = readMicros(view, 8), byId = new Map();
  const number = ({ type, value, to }) => (value + TYPES[type][0] <= to ? Number(view[TYPES[type][1]](value, true)) : NaN);
  for (const message of messagesOf(bytes, view, end)) {
    if (message.kind === 'D') {
      const topic = byId.get(message.id);
      if (topic === null) continue;
      if (!topic || message.to - message.from < topic.layout.size) { log.short++; continue; }
      const time = readMicros(view, message.from + topic.layout.stamp);
      // Zero is no time, unless the log begins there.
      if (!time && started) continue;
      topic.times.push(time);
      topic.offsets.push(message.from);
    } else if (message.kind === 'F') {
      log.formats.set(message.name, { fields: message.fields, layout: null });
    } else if (message.kind === 'I') {
      if (message.type === 'char') log.info.set(message.name, new TextDecoder().decode(bytes.subarray(message.value, message.to)));
      else if (TYPES[message.type]) log.info.set(message.name, number(message));
    } else if (message.kind === 'P') {
      log.parameters.push([message.name, number(message)]);
    } else if (message.kind === 'A') {
      byId.set(message.id, subscribed(log, message));
    } else if (message.kind === 'L' || message.kind === 'C') {
      log.texts.push([message.at, message.text]);
    }
  }
  for (const { layout } of log.topics.values()) giveMeaning(log, layout);
  return log;
};

/** The topic that a subscription begins, or goes on with under another number; null where its samples are passed over. */
const subscribed = (log, { topic: format, instance }) => {
  // Which runnable ran when is half of a log, and for a replay alone.
  if (format.startsWith('activation_')) return null;
  const name = instance ? `${format}[${instance}]` : format;
  const leaveOut = (reason) => {
    if (log.omissions.length < 100) log.omissions.push(`topic ${name.slice(0, 100)} left out: ${reason}`);
    return null;
  };
  const layout = layOut(log, format);
  if (layout.failure) return leaveOut(layout.failure);
  for (let count = 1; count <= 16; count++) {
    const numbered = count === 1 ? name : `${name}#${count}`, known = log.topics.get(numbered);
    if (known?.layout.key === layout.key) return known;
    if (known) continue;
    const { left } = log;
    if (!left.topics) return leaveOut('the log has too many topics');
    if (left.columns < layout.columns || left.fields < layout.fields.length) return leaveOut('the log has too many columns');
    left.topics--;
    left.columns -= layout.columns;
    left.fields -= layout.fields.length;
    const topic = { format, name: numbered, layout, times: [], offsets: [] };
    log.topics.set(numbered, topic);
    return topic;
  }
  return leaveOut('its format changes too often');
};

/** The layout of a format, or why it has none: found out once, whatever refers to it. */
const layOut = (log, name) => {
  const format = log.formats.get(name);
  if (!format) return { failure: 'the log has no format of this name' };
  if (!log.left.steps) return { failure: 'the log has too many columns' };
  try {
    format.layout ??= unfolded(log, name, format.fields);
  } catch (error) {
    format.layout = { failure: error.message };
  }
  return format.layout;
};

/** Where the scalars and arrays of a topic's sample are, formats within its format unfolded: `current.lat`, `esc[0].esc_rpm`. */
const unfolded = (log, name, fields) => {
  const layout = { format: name, key: '', fields: [], columns: 0, stamp: -1, size: 0, hasMeaning: false };
  let offset = 0, steps = MOST.stepsOfOne;
  const step = (count) => {
    steps -= count;
    log.left.steps = Math.max(log.left.steps - count, 0);
    if (steps < 0 || !log.left.steps) throw new Error('its fields are too many');
  };
  const unfold = (text, prefix, depth) => {
    if (depth > MOST.depth) throw new Error('a format holds itself, or formats are too deep in one another');
    step(1 + text.length / 64); // So many letters cost as much as a field.
    for (const part of text.split(';')) {
      step(1);
      if (!part.trim()) continue;
      const declared = parseDeclaration(part);
      if (!declared) throw new Error(`${part.slice(0, 100)} is no field declaration`);
      const { type, count } = declared, path = prefix + declared.name, known = Object.hasOwn(TYPES, type) ? TYPES[type] : null;
      if (path.length > MOST.name) throw new Error(`a field has a name of more than ${MOST.name} letters`);
      if (!known) {
        const inner = log.formats.get(type);
        if (!inner) throw new Error(`type ${type.slice(0, 100)} is neither a basic one nor a format of the log`);
        for (let index = 0; index < (count ?? 1); index++) {
          step(1);
          unfold(inner.fields, `${path}${count === undefined ? '' : `[${index}]`}.`, depth + 1);
        }
        continue;
      }
      const size = known[0] * (count ?? 1);
      if (offset + size > MOST.sample) throw new Error('a sample would be longer than a message');
      if (path === 'timestamp' && type === 'uint64_t' && layout.stamp < 0) {
        layout.stamp = offset;
        layout.size = offset + size;
      } else if (!declared.name.startsWith('_padding')) {
        layout.fields.push({ name: path, type, count: count ?? 1, offset, unit: '', names: [] });
        layout.columns += count ?? 1;
        layout.size = offset + size;
      }
      offset += size;
    }
  };
  unfold(fields, '', 1);
  if (layout.stamp < 0) throw new Error('the format has no timestamp');
  layout.key = layout.fields.map((field) => `${field.name} ${field.type} ${field.count} ${field.offset}`).join(';');
  return layout;
};

/** Units and names of values, as the log's infos say. Instances share them. */
const giveMeaning = (log, layout) => {
  if (layout.hasMeaning) return;
  layout.hasMeaning = true;
  const pairs = (key) => String(log.info.get(key) ?? '').split(' ').filter(Boolean).map((part) => part.split('='));
  const units = new Map(pairs(`units/${layout.format}`));
  for (const field of layout.fields) {
    field.unit = (units.get(field.name) ?? '').slice(0, 64);
    field.names = pairs(`names/${layout.format}/${field.name}`).map(([word, code]) => [word, Number(code)]);
  }
};

/** What a vehicle's card says, from a log. What the page shows of it is a known card's of the same kind, or any. */
const cardOfLog = (log, title, cards) => {
  const kind = log.info.get('sys_name') ?? '';
  const known = cards.find((card) => card.kind === kind) ?? cards[0];
  const topics = [...log.topics.values()].map(({ name, layout }) => {
    const ours = new Map(known?.topics.find((topic) => topic.name === name)?.fields.map((field) => [field.name, field]));
    const fields = layout.fields.map((entry) => {
      const kind = ours.get(entry.name)?.kind ?? (entry.names.length ? 'enum' : 'number');
      return { name: entry.name, unit: entry.unit, count: entry.count, kind, names: entry.names };
    });
    return { name, doc: '', rate: '', fields };
  });
  const parameters = log.parameters.map(([name, value]) => {
    const same = known?.parameters.find((parameter) => parameter.name === name);
    return { name, value, unit: same?.unit ?? '', meaning: same?.meaning ?? '', default: same?.default ?? value, range: same?.range ?? null };
  });
  return { ...known, name: title, kind, topics, parameters, faults: [], missions: [], offers: [], calibrations: [], place: [0, 0] };
};

/** The vehicle of a log. `vehicle.seek(time)` makes it what it was then. */
const vehicleOfLog = (log, title, cards) => {
  const used = [...log.topics.values()].filter((topic) => topic.times.length && topic.layout.fields.length);
  const vehicle = makeVehicle(cardOfLog(log, title, cards), -1);
  const ours = new Set(topicsOf(vehicle.card));
  const shown = used.filter((topic) => ours.has(topic.name));
  const spans = (shown.length ? shown : used).map((topic) => [topic.times[0], topic.times[topic.times.length - 1]]);
  if (!spans.length) throw new Error('this log has no samples');
  vehicle.start = Math.min(...spans.map(([from]) => from));
  vehicle.end = Math.max(vehicle.start, ...spans.map(([, to]) => to));
  vehicle.isLog = true;
  const decode = (topic, offset) => {
    const values = [];
    for (const { type, count, offset: place } of topic.layout.fields) {
      const [size, get] = TYPES[type];
      for (let index = 0; index < count; index++) values.push(Number(log.view[get](offset + place + index * size, true)));
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

