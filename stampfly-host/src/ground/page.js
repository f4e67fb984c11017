const ws = new WebSocket(`ws://${location.host}/ws`);
ws.onmessage = (event) => { document.getElementById('out').textContent = event.data.slice(0, 2000); };
