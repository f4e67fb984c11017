// Every topic of the chosen vehicle: samples a second, and, of one that is opened, its newest numbers in words.

const topics = { vehicle: null, rows: [], open: null };
const topicsAreShown = () => !element('rates').closest('[hidden]');

/** Topics that are sent: what the page draws, and everything while the list is in sight. */
const subscribeAgain = () => {
  const wanted = ({ card }) => (topicsAreShown() ? card.topics.map((topic) => topic.name) : topicsOf(card));
  return subscribe([...new Set(station.vehicles.flatMap(wanted))].slice(0, 64));
};

const buildTopics = (vehicle) => {
  topics.vehicle = vehicle;
  topics.open = null;
  const body = element('rates');
  body.replaceChildren();
  topics.rows = vehicle.list.filter((topic) => topic.fields.length).map((topic) => {
    const row = make('tr', body);
    const name = make('th', row);
    name.scope = 'row';
    const button = make('button', name, 'plain', topic.name);
    button.type = 'button';
    button.setAttribute('aria-expanded', 'false');
    button.title = topic.doc;
    const rate = make('td', row);
    make('td', row, 'dim', topic.rate);
    const values = make('tr', body);
    values.hidden = true;
    const cell = make('td', values);
    cell.colSpan = 3;
    const list = make('dl', cell, 'values');
    const outputs = topic.fields.map((entry) => {
      make('dt', list, '', entry.name);
      return make('dd', list, '', '–');
    });
    const entry = { topic, rate, button, values, outputs, count: topic.count, at: vehicle.clock };
    button.addEventListener('click', () => {
      const opens = topics.open !== entry;
      for (const other of topics.rows) {
        other.values.hidden = !(other === entry && opens);
        other.button.setAttribute('aria-expanded', other === entry && opens);
      }
      topics.open = opens ? entry : null;
    });
    return entry;
  });
};

/** A field in words. */
const inWords = (vehicle, topic, entry) => {
  const values = field(vehicle, topic.name, entry.name);
  if (!values) return '–';
  if (entry.kind === 'enum' || entry.kind === 'flags') {
    const said = named(vehicle, topic.name, entry.name);
    return Array.isArray(said) ? said.join(' ') || 'none' : said;
  }
  if (entry.kind === 'bool') return values.map((value) => (value ? 'yes' : 'no')).join('  ');
  const short = (value) => (Number.isInteger(value) ? String(value) : Number.isFinite(value) ? Number(value.toPrecision(5)).toString() : '–');
  return `${values.map(short).join('  ').replaceAll('-', '−')} ${entry.unit}`;
};

/** Once a second. */
const writeRates = (vehicle) => {
  if (!topicsAreShown() || topics.vehicle !== vehicle) return;
  for (const entry of topics.rows) {
    const [samples, time] = [entry.topic.count - entry.count, vehicle.clock - entry.at];
    const rate = samples / time;
    entry.rate.textContent = time > 0 && samples > 0 ? `${rate.toFixed(rate < 10 ? 1 : 0)} Hz` : '–';
    [entry.count, entry.at] = [entry.topic.count, vehicle.clock];
  }
};

/** Ten times a second. */
const writeTopic = (vehicle) => {
  const { open } = topics;
  if (!open || !topicsAreShown() || topics.vehicle !== vehicle) return;
  open.topic.fields.forEach((entry, index) => setText(open.outputs[index], inWords(vehicle, open.topic, entry)));
};

