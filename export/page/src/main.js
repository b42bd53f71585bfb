// Starts the page, or says why it cannot be shown.
import { App } from './app.js';
import { byId } from './dom.js';
import { unpack } from './pack.js';

async function start() {
  const holder = byId('map');
  const map = await unpack(holder.textContent.trim());
  holder.remove();
  document.title = `${map.document.title} · slcmap`;
  const app = new App(map);
  byId('loading').remove();
  return app;
}

// For other scripts: a promise of the page's App.
window.slcmap = start().catch((error) => {
  const what =
    typeof DecompressionStream === 'undefined'
      ? 'This browser is too old: it cannot decompress the map.'
      : `The map cannot be shown: ${error.message}`;
  byId('loading').textContent = what;
  throw error;
});
