// See page_speed.sh: the first view of a tileset, its memory, and a frame of tiles beside a frame of
// the same points and lines from one buffer each.
import { spawn } from 'node:child_process';
import { readFileSync, readdirSync } from 'node:fs';
import { launch } from '../export/web/browser.mjs';

const [program, folder] = process.argv.slice(2);
const FRAMES = 8;

function tell(name, text) {
  console.log(name.padEnd(23) + text);
}

// Memory of all processes of the browser, each shared page once.
function memoryOfBrowser_MB() {
  let memory_MB = 0;
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      if (!readFileSync(`/proc/${pid}/cmdline`, 'utf8').includes('chromium')) continue;
      const rollup = readFileSync(`/proc/${pid}/smaps_rollup`, 'utf8');
      memory_MB += Number(/Pss:\s+(\d+)/.exec(rollup)[1]) / 1000;
    } catch {
      // It has ended.
    }
  }
  return memory_MB;
}

async function serve() {
  const server = spawn(program, ['view', '--serve', folder, '--port', '0']);
  const address = await new Promise((resolve) => {
    let said = '';
    server.stderr.on('data', (text) => {
      said += text;
      const found = /http:\/\/127\.0\.0\.1:\d+\//.exec(said);
      if (found) resolve(found[0]);
    });
  });
  return { server, address };
}

// Medians of frames, each to its end: of the tiles, and of all that they show in one buffer a kind.
async function frames_ms(page) {
  return page.evaluate(async (count) => {
    const { view, tiles } = app;
    const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
    const time = async () => {
      const times_ms = [];
      for (let i = 0; i < count; i++) {
        const from_ms = performance.now();
        view.renderer.render(view.scene, view.camera);
        await view.untilDrawn();
        times_ms.push(performance.now() - from_ms);
      }
      return median(times_ms);
    };
    const valuesOf = ({ index, attributes }, name) => {
      const { count, itemSize, array, offset = 0, data } = attributes[name];
      const vertices = index?.array ?? Array.from({ length: count }, (_, i) => i);
      const stride = data?.stride ?? itemSize;
      const values = new array.constructor(itemSize * vertices.length);
      vertices.forEach((vertex, i) => {
        for (let k = 0; k < itemSize; k++) values[itemSize * i + k] = array[stride * vertex + offset + k];
      });
      return values;
    };
    const parts = [...tiles.shown.keys()];
    const own_ms = await time();
    for (const kind of ['isPoints', 'isLineSegments']) {
      const of = parts.filter((part) => part[kind]);
      if (of.length === 0) continue;
      const one = of[0].clone();
      one.geometry = of[0].geometry.clone();
      one.geometry.setIndex(null);
      for (const name of Object.keys(one.geometry.attributes)) {
        const first = of[0].geometry.attributes[name];
        const { constructor } = first.isInterleavedBufferAttribute ? first.clone() : first;
        const arrays = of.map(({ geometry }) => valuesOf(geometry, name));
        const all = new first.array.constructor(arrays.reduce((sum, { length }) => sum + length, 0));
        let at = 0;
        for (const array of arrays) {
          all.set(array, at);
          at += array.length;
        }
        one.geometry.setAttribute(name, new constructor(all, first.itemSize, first.normalized));
      }
      one.geometry.setDrawRange(0, Infinity);
      one.frustumCulled = false;
      of.forEach((part) => (part.visible = false));
      of[0].parent.add(one);
    }
    await time(); // uploads
    return [own_ms, await time(), parts.length];
  }, FRAMES);
}

const { server, address } = await serve();
const browser = await launch();
const page = await browser.newPage({ viewport: { width: 1400, height: 900 } });
page.on('pageerror', (error) => console.log(String(error)));
page.setDefaultTimeout(0);
const from_ms = performance.now();
const since = () => `${((performance.now() - from_ms) / 1000).toFixed(1)} s`;
await page.goto(address);
tell('page', since());
const counts = () => page.evaluate(() => app.tiles.counts());
await page.evaluate(async () => {
  window.app = await window.slcmap;
  const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const isShown = () => app.tiles.counts().points > 0 && app.tiles.counts().lines > 0;
  while (!app.sets || !isShown()) await frame();
  await app.view.untilDrawn();
});
tell('first view', `${since()}, ${JSON.stringify(await counts())}`);
let before = '';
for (let same = 0; same < 4;) {
  await new Promise((resolve) => setTimeout(resolve, 500));
  const now = JSON.stringify([await counts(), await page.evaluate(() => app.tiles.error_px)]);
  same = now === before && !(await page.evaluate(() => app.tiles.isLoading())) ? same + 1 : 0;
  before = now;
}
tell('at rest', `${since()}, ${before}`);
tell('memory', `${memoryOfBrowser_MB().toFixed(0)} MB of the browser`);
const [own_ms, one_ms, parts] = await frames_ms(page);
tell('frame', `${own_ms.toFixed(0)} ms of ${parts} tiles, ${one_ms.toFixed(0)} ms from one buffer`);
await browser.close();
server.kill();
