// A log file that is opened here: the slider is its time, the view and the plots follow.

const playback = { vehicle: null, playing: false, last: 0 };

const openLog = async (file) => {
  try {
    const parsed = readLog(await file.arrayBuffer());
    log(`${file.name}: ${parsed.topics.size} topics${parsed.short ? `, ${parsed.short} samples left out` : ''}`);
    if (parsed.end.places) log(`${file.name}: the log is ${sayEnd(parsed.end)}`, 'bad');
    for (const omission of parsed.omissions.slice(0, 5)) log(`${file.name}: ${omission}`, 'bad');
    const vehicle = vehicleOfLog(parsed, file.name, cards());
    playback.vehicle = vehicle;
    playback.playing = false;
    element('player').hidden = false;
    element('live').hidden = false;
    const slider = element('slider');
    [slider.min, slider.max, slider.value] = [vehicle.start, vehicle.end, vehicle.start];
    setText(element('log-name'), `${file.name} · ${vehicle.card.kind || 'unknown vehicle'} · ${(vehicle.end - vehicle.start).toFixed(1)} s`);
    choose(null);
    for (const [at, text] of parsed.texts.slice(-50)) log(`${at.toFixed(2)} s ${text}`);
  } catch (error) {
    log(`${file.name}: ${error.message}`, 'bad');
  }
};

const closeLog = () => {
  playback.vehicle = null;
  element('player').hidden = element('live').hidden = true;
  choose(0);
};

const setPlayTime = (time) => {
  const { vehicle } = playback;
  vehicle.seek(clamp(time, vehicle.start, vehicle.end));
  element('slider').value = vehicle.clock;
};

const tickPlayback = (now) => {
  const { vehicle } = playback;
  if (vehicle && playback.playing) {
    setPlayTime(vehicle.clock + Math.min((now - playback.last) / 1000, 0.1));
    if (vehicle.clock >= vehicle.end) playback.playing = false;
  }
  playback.last = now;
  setText(element('play'), playback.playing ? '❚❚' : '▶');
};

const buildPlayback = () => {
  element('slider').addEventListener('input', (event) => { playback.playing = false; setPlayTime(Number(event.target.value)); });
  element('play').addEventListener('click', () => {
    const { vehicle } = playback;
    if (!playback.playing && vehicle.clock >= vehicle.end) setPlayTime(vehicle.start);
    playback.playing = !playback.playing;
  });
  element('live').addEventListener('click', closeLog);
  element('log-file').addEventListener('change', (event) => { if (event.target.files[0]) openLog(event.target.files[0]); event.target.value = ''; });
  element('log-open').addEventListener('click', () => element('log-file').click());
  const over = (event, inside) => {
    if (![...(event.dataTransfer?.types ?? [])].includes('Files')) return;
    event.preventDefault();
    document.body.classList.toggle('dropping', inside);
  };
  document.addEventListener('dragover', (event) => over(event, true));
  document.addEventListener('dragleave', (event) => { if (!event.relatedTarget) over(event, false); });
  document.addEventListener('drop', (event) => {
    over(event, false);
    if (event.dataTransfer.files[0]) openLog(event.dataTransfer.files[0]);
  });
};

