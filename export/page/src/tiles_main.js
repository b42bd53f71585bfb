// Starts the page of tilesets: those that a server has beside it, else those of a folder that the
// user picks.
import { byId } from './dom.js';
import { TilesApp } from './tiles_app.js';

function start() {
  const tilesets = JSON.parse(byId('map').textContent);
  const app = new TilesApp();
  byId('folder').addEventListener('change', () => app.openFolder(byId('folder').files));
  if (location.protocol === 'file:') app.askForFolder();
  else app.openUrls(tilesets.map((path) => new URL(encodeURI(path), location.href).href));
  return app;
}

// For other scripts: a promise of the page's TilesApp.
window.slcmap = new Promise((resolve) => resolve(start())).catch((error) => {
  byId('loading').textContent = `The page cannot be shown: ${error.message}`;
  throw error;
});
