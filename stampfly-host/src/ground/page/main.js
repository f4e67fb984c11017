// Everything put together: vehicles as the server names them, what arrives, one drawing per frame.

const station = { vehicles: [], chosen: 0 };
const cards = () => station.vehicles.map((vehicle) => vehicle.card);
const scene = () => (playback.vehicle ? [playback.vehicle] : station.vehicles);
const selected = () => playback.vehicle ?? station.vehicles[station.chosen];

/** Chooses a vehicle; `null` is the log. */
const choose = (number) => {
  if (number !== null) {
    station.chosen = clamp(number, 0, Math.max(station.vehicles.length - 1, 0));
    playback.vehicle = null;
    element('player').hidden = element('live').hidden = true;
  }
  stopMotor();
  dropSticks();
  const vehicle = selected();
  element('empty').hidden = Boolean(vehicle);
  if (!vehicle) return;
  for (const tab of element('vehicles').children) tab.setAttribute('aria-pressed', Number(tab.dataset.number) === vehicle.number);
  setText(element('chosen'), vehicle.card.name);
  buildParameters(vehicle);
  buildFaults(vehicle);
  buildCalibration(vehicle);
  buildTopics(vehicle);
  offer(vehicle);
  element('key-main').style.color = `var(${colorOf(vehicle)})`;
  const download = element('download');
  download.hidden = vehicle.isLog;
  download.href = logAddress(vehicle.number);
  download.download = `${vehicle.card.name.replaceAll(/\W+/g, '-').toLowerCase()}.ulg`;
};

on('hello', (hello) => {
  words = hello.words;
  station.vehicles = hello.vehicles.map((card, number) => makeVehicle(card, number));
  const tabs = element('vehicles');
  tabs.replaceChildren();
  for (const vehicle of station.vehicles) {
    const tab = make('button', tabs, '', vehicle.card.name);
    tab.type = 'button';
    tab.dataset.number = vehicle.number;
    tab.addEventListener('click', () => choose(vehicle.number));
  }
  tabs.hidden = station.vehicles.length < 2;
  setText(element('version'), hello.version);
  subscribeAgain();
  if (!playback.vehicle) {
    choose(station.chosen);
    resetCamera();
  }
});

on('state', (state) => {
  for (const [number, clock, ...samples] of state) {
    const vehicle = station.vehicles[number];
    if (!vehicle) continue;
    if (clock < vehicle.clock) forget(vehicle);
    if (clock !== vehicle.clock) vehicle.moved = performance.now();
    vehicle.clock = clock;
    for (const [place, count, at, ...values] of samples) {
      const topic = vehicle.list[place];
      if (!topic) continue;
      // JSON has no NaN.
      for (let index = 0; index < values.length; index++) values[index] ??= NaN;
      Object.assign(topic, { count, at, values });
    }
    keepFrame(vehicle);
    if (vehicle.goal && !['Armed', 'TakeOff', 'Flying', 'Flip', null].includes(phaseOf(vehicle))) vehicle.goal = null;
  }
});

on('event', (event) => {
  const vehicle = station.vehicles[event.vehicle];
  if (!vehicle) return;
  if (event.kind === 'parameter') {
    const parameter = vehicle.card.parameters.find(({ name }) => name === event.name);
    if (!parameter) return;
    parameter.value = event.value;
    vehicle.rows?.find((row) => row.parameter === parameter)?.show();
  } else if (event.kind === 'speed') {
    element('speed').value = String(event.factor);
    log(`time ×${event.factor}`);
  } else if (event.kind === 'commander') {
    vehicle.commander = event;
  } else if (event.kind === 'link') {
    vehicle.away = event.up ? '' : event.text;
    log(`${vehicle.card.name}: ${event.text}`, event.up ? '' : 'bad');
  } else {
    if (event.kind === 'ended') vehicle.ended = event.text;
    log(`${vehicle.card.name}, ${event.at.toFixed(1)} s: ${event.text}`, event.kind === 'ended' ? 'bad' : '');
  }
});

on('link', (isOpen) => {
  log(isOpen ? 'connected' : 'the connection is lost; trying again', isOpen ? '' : 'bad');
  writeLink();
});

const buildTabs = () => {
  const tabs = [...document.querySelectorAll('[role=tab]')];
  const show = (tab) => {
    for (const other of tabs) {
      const isShown = other === tab;
      other.setAttribute('aria-selected', isShown);
      other.tabIndex = isShown ? 0 : -1;
      element(other.getAttribute('aria-controls')).hidden = !isShown;
    }
    stopMotor();
    subscribeAgain();
  };
  tabs.forEach((tab) => {
    tab.addEventListener('click', () => show(tab));
    tab.addEventListener('keydown', (event) => {
      const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!by) return;
      event.preventDefault();
      const shown = tabs.filter((other) => !other.hidden);
      const next = shown[(shown.indexOf(tab) + by + shown.length) % shown.length];
      show(next);
      next.focus();
    });
  });
  show(tabs[0]);
};

let written = 0;
const frame = (now) => {
  tickPlayback(now);
  const vehicle = selected();
  drawSpace();
  drawSticks();
  if (vehicle) {
    drawStrips(vehicle);
    drawHorizon(element('horizon'), poseOf(vehicle, observersOf(vehicle.card).main)?.attitude);
    // Words and numbers change ten times a second.
    if (now - written > 100) {
      written = now;
      writeStatus(vehicle);
      writeStrips(vehicle);
      writeTopic(vehicle);
      writeCalibration(vehicle);
    }
  }
  requestAnimationFrame(frame);
};

buildTabs();
buildControls();
buildSticks();
buildStickFile();
buildPanels();
buildPlayback();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { styles = getComputedStyle(document.documentElement); });
setInterval(writeOld, 200);
setInterval(() => {
  measureLink();
  writeLink();
  if (selected()) writeRates(selected());
}, 1000);
connect();
requestAnimationFrame(frame);
