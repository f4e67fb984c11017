// Parameters, faults, motors and the console of the chosen vehicle.

const shown = { parameters: null, faults: null };
const digitsOf = (value) => Number(value.toPrecision(7)).toString();
const matches = (text, query) => query.toLowerCase().split(/\s+/).every((word) => text.toLowerCase().includes(word));

const buildParameters = (vehicle) => {
  shown.parameters = vehicle;
  const body = element('parameters');
  body.replaceChildren();
  const canSet = !vehicle.isLog && vehicle.card.offers.includes('param_set');
  vehicle.rows = vehicle.card.parameters.map((parameter) => {
    const row = make('tr', body);
    row.dataset.name = parameter.name;
    const name = make('th', row, '', parameter.name);
    name.scope = 'row';
    make('small', name, '', parameter.meaning);
    const form = make('form', make('td', row));
    const input = make('input', form);
    input.type = 'number';
    input.step = 'any';
    if (parameter.range) [input.min, input.max] = parameter.range;
    input.setAttribute('aria-label', `${parameter.name}, ${parameter.unit === '1' ? 'no unit' : parameter.unit}`);
    input.disabled = !canSet;
    make('span', form, 'dim', parameter.unit === '1' ? '' : parameter.unit);
    const note = make('small', form, 'note');
    const back = make('button', make('td', row), 'small', 'default');
    back.type = 'button';
    back.title = `Back to ${digitsOf(parameter.default)}`;
    const entry = { parameter, row, text: `${parameter.name} ${parameter.meaning}`, note };
    entry.show = () => {
      if (document.activeElement !== input) input.value = digitsOf(parameter.value);
      entry.isChanged = Math.abs(parameter.value - parameter.default) > 1e-6 * Math.abs(parameter.default);
      row.classList.toggle('changed', entry.isChanged);
      back.hidden = !entry.isChanged || !canSet;
    };
    const set = async (value) => {
      note.className = 'note';
      if (!Number.isFinite(value)) { note.textContent = 'no number'; note.className = 'note bad'; return; }
      const reply = await ask(vehicle.number, { do: 'param_set', name: parameter.name, value });
      note.textContent = reply.ok ? '✓' : reply.text;
      note.className = reply.ok ? 'note good' : 'note bad';
      if (reply.ok) parameter.value = reply.value ?? value;
      input.value = digitsOf(parameter.value);
      entry.show();
    };
    form.noValidate = true;
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      const range = parameter.range;
      const value = input.value.trim() === '' ? NaN : Number(input.value);
      if (range && (value < range[0] || value > range[1])) {
        note.textContent = `${digitsOf(range[0])} to ${digitsOf(range[1])}`;
        note.className = 'note bad';
      } else set(value);
    });
    input.addEventListener('change', () => form.requestSubmit());
    back.addEventListener('click', () => set(parameter.default));
    entry.show();
    return entry;
  });
  filterParameters();
};

const filterParameters = () => {
  const query = element('parameter-search').value.trim(), only = element('parameter-changed').checked;
  let count = 0;
  for (const { row, text, isChanged } of shown.parameters?.rows ?? []) {
    row.hidden = !(matches(text, query) && (!only || isChanged));
    if (!row.hidden) count++;
  }
  setText(element('parameter-count'), `${count} of ${shown.parameters?.rows.length ?? 0}`);
};

const buildFaults = (vehicle) => {
  shown.faults = vehicle;
  const list = element('faults');
  list.replaceChildren();
  const canInject = !vehicle.isLog && vehicle.card.offers.includes('fault');
  vehicle.faultRows = vehicle.card.faults.map((fault) => {
    const item = make('li', list);
    item.dataset.name = fault.name;
    const button = make('button', item, '', fault.name);
    button.disabled = !canInject;
    if (!canInject) button.title = 'Not offered by this vehicle';
    let input = null;
    if (fault.range) {
      input = make('input', item);
      input.type = 'number';
      input.step = 'any';
      [input.min, input.max] = fault.range;
      input.placeholder = fault.default === null ? 'last' : String(fault.default);
      input.setAttribute('aria-label', `${fault.name}, value ${fault.range[0]} to ${fault.range[1]} ${fault.unit}`);
      make('span', item, 'dim', fault.unit);
    }
    make('small', item, '', fault.meaning);
    button.addEventListener('click', () => {
      const value = input && input.value.trim() !== '' ? `=${Number(input.value)}` : '';
      const lasts = element('fault-seconds').value.trim();
      const text = `${fault.name}${value}@0${lasts === '' ? '' : `+${Number(lasts)}`}`;
      command({ do: 'fault', text }, `fault ${fault.name}${value}`);
    });
    return { item, text: `${fault.name} ${fault.meaning}` };
  });
  element('no-faults').hidden = vehicle.card.faults.length > 0;
  filterFaults();
};
const filterFaults = () => {
  const query = element('fault-search').value.trim();
  for (const { item, text } of shown.faults?.faultRows ?? []) item.hidden = !matches(text, query);
};

// Motors turn only while something is held, and stop with any key, pointer or change of focus.
const REPEAT = 250;
const motors = { timer: 0, running: 0 };
const stopMotor = () => {
  if (!motors.running) return;
  clearInterval(motors.timer);
  element(`motor-${motors.running}`)?.classList.remove('running');
  motors.running = 0;
  const vehicle = live();
  if (vehicle) ask(vehicle.number, { do: 'motor_stop' });
};
const startMotor = (motor) => {
  stopMotor();
  const vehicle = live();
  if (!vehicle || !element('motor-safe').checked) { log('first say that the propellers are off', 'bad'); return; }
  motors.running = motor;
  element(`motor-${motor}`).classList.add('running');
  const turn = async () => {
    const reply = await ask(vehicle.number, { do: 'motor_test', motor, duty: Number(element('motor-duty').value) / 100 });
    if (!reply.ok && motors.running === motor) {
      log(`motor ${motor}: ${reply.text}`, 'bad');
      stopMotor();
    }
  };
  turn();
  motors.timer = setInterval(turn, REPEAT);
};

const buildMotors = () => {
  const places = ['M1 front right', 'M2 rear right', 'M3 rear left', 'M4 front left'];
  places.forEach((title, index) => {
    const button = make('button', element('motors'), `motor m${index + 1}`, title);
    button.id = `motor-${index + 1}`;
    button.type = 'button';
    button.dataset.needs = 'motor_test';
    button.addEventListener('pointerdown', (event) => { if (event.button === 0) startMotor(index + 1); });
    button.addEventListener('keydown', (event) => {
      if ((event.key === ' ' || event.key === 'Enter') && !event.repeat && !motors.running) {
        event.preventDefault();
        event.stopImmediatePropagation();
        startMotor(index + 1);
      } else if (event.repeat && motors.running) { event.preventDefault(); event.stopImmediatePropagation(); }
    });
    button.addEventListener('contextmenu', (event) => event.preventDefault());
  });
  for (const kind of ['pointerup', 'pointercancel', 'keyup', 'keydown']) document.addEventListener(kind, stopMotor);
  element('motors').addEventListener('pointerleave', stopMotor);
  element('motors').addEventListener('focusout', (event) => { if (!element('motors').contains(event.relatedTarget)) stopMotor(); });
  window.addEventListener('blur', stopMotor);
  document.addEventListener('visibilitychange', stopMotor);
  element('motor-duty').addEventListener('input', () => setText(element('motor-percent'), `${element('motor-duty').value} %`));
};

const history = { lines: [], at: 0 };
const buildConsole = () => {
  const input = element('console-line'), output = element('console-output');
  element('console-form').addEventListener('submit', async (event) => {
    event.preventDefault();
    const vehicle = live(), line = input.value.trim();
    if (!vehicle || !line) return;
    history.lines.push(line);
    history.at = history.lines.length;
    input.value = '';
    make('div', output, 'asked', `${vehicle.card.name}> ${line}`);
    const reply = await ask(vehicle.number, { do: 'console', line });
    make('div', output, reply.ok ? '' : 'bad', reply.text.replaceAll('\r', '').trimEnd() || (reply.ok ? 'ok' : 'refused'));
    while (output.children.length > 400) output.firstChild.remove();
    output.scrollTop = output.scrollHeight;
  });
  input.addEventListener('keydown', (event) => {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!by) return;
    event.preventDefault();
    history.at = clamp(history.at + by, 0, history.lines.length);
    input.value = history.lines[history.at] ?? '';
  });
};

const buildPanels = () => {
  element('parameter-search').addEventListener('input', filterParameters);
  element('parameter-changed').addEventListener('change', filterParameters);
  element('parameter-save').addEventListener('click', () => command({ do: 'param_save' }, 'keep the parameters'));
  element('fault-search').addEventListener('input', filterFaults);
  element('fault-clear').addEventListener('click', () => command({ do: 'fault_clear' }, 'end the faults'));
  buildMotors();
  buildConsole();
};

