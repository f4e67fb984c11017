// What only the page with the vehicle inside can do: look back at the flight, and fly it again with other parameters.

const buildAgain = () => {
  const download = element('download');
  download.addEventListener('click', async (event) => {
    event.preventDefault();
    const file = await logSoFar(station.vehicles[station.chosen]);
    const save = document.createElement('a');
    save.href = URL.createObjectURL(file);
    save.download = file.name;
    save.click();
    setTimeout(() => URL.revokeObjectURL(save.href), 1000);
  });
  const look = make('button', download.parentElement, '', 'Look back at the flight');
  look.type = 'button';
  look.id = 'look-back';
  look.addEventListener('click', async () => openLog(await logSoFar(station.vehicles[station.chosen])));

  const again = document.createElement('p');
  again.className = 'buttons';
  element('panel-parameters').prepend(again);
  const fly = make('button', again, '', 'Fly it again with these parameters');
  fly.type = 'button';
  fly.id = 'fly-again';
  make('span', again, 'dim', 'from power-on, with everything that was asked for, beside the flight as it was');
  fly.addEventListener('click', () => {
    say(0, { do: 'fly_again' });
    log('The flight again: StampFly with the new parameters, beside it as it flew before.');
  });
};

buildAgain();
