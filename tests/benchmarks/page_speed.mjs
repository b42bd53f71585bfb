// See page_speed.sh.
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { launch, open, settle } from '../export/web/browser.mjs';

const large = process.argv[2];
const VIEWPORT = { width: 1400, height: 900 };
const FRAMES = 6;

function median(values) {
  return [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
}

// Seconds of CPU that the processes begun by this one have taken: unlike the time that passes, it
// says something on a busy machine too.
function cpuOfChildren() {
  const TICKS_S = 100;
  const processes = readdirSync('/proc')
    .filter((name) => /^\d+$/.test(name))
    .flatMap((pid) => statOf(pid));
  const below = new Set([process.pid]);
  let cpu_s = 0;
  for (let grown = true; grown;) {
    grown = false;
    for (const { pid, parent, ticks } of processes) {
      if (below.has(pid) || !below.has(parent)) continue;
      below.add(pid);
      cpu_s += ticks / TICKS_S;
      grown = true;
    }
  }
  return cpu_s;
}

// Of a process that may have ended meanwhile: none or one.
function statOf(pid) {
  try {
    const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
    return [
      {
        pid: Number(pid),
        parent: Number(fields[1]),
        ticks: Number(fields[11]) + Number(fields[12]),
      },
    ];
  } catch {
    return [];
  }
}

// Frames of the page while it is turned, each to its end.
async function framesOfPage(page, frames) {
  return page.evaluate(async (count) => {
    const { view } = app;
    const { object, target } = view.controls.space;
    const times_ms = [];
    for (let i = 0; i < count; i++) {
      object.position.sub(target).applyAxisAngle(object.up, 0.02).add(target);
      const from_ms = performance.now();
      view.controls.space.update();
      view.draw(from_ms);
      await view.untilDrawn();
      times_ms.push(performance.now() - from_ms);
    }
    return times_ms;
  }, frames);
}

// Picks at places all over the canvas, of lines and planes and, as when points are measured, of the
// dense cloud.
async function hoverTimes(page, only) {
  return page.evaluate((which) => {
    const { width, height } = app.view.size;
    const times_ms = [];
    for (let i = 0; i < 200; i++) {
      const place = [((i * 0.618034) % 1) * width, ((i * 0.754878) % 1) * height];
      const from_ms = performance.now();
      app.picker.pick(...place, which);
      times_ms.push(performance.now() - from_ms);
    }
    return times_ms;
  }, only);
}

// Waits for the first frame, to its end, and for what is under the pointer.
async function untilShown(page) {
  await page.evaluate(async () => {
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    while (app.view.frames === 0) await frame();
    await app.view.untilDrawn();
    app.picker.pick(0.5 * app.view.size.width, 0.5 * app.view.size.height);
  });
}

function tell(name, text) {
  console.log(name.padEnd(23) + text);
}

const browser = await launch();
tell('size', `${(statSync(large).size * 1e-6).toFixed(1)} MB`);
const [from_ms, from_cpu_s] = [performance.now(), cpuOfChildren()];
const page = await open(browser, large, { viewport: VIEWPORT });
await untilShown(page);
const tellLoad = (name, what) => {
  const load_s = (performance.now() - from_ms) / 1000;
  const cpu_s = cpuOfChildren() - from_cpu_s;
  tell(name, `${load_s.toFixed(2)} s, ${cpu_s.toFixed(2)} s of CPU, ${what}`);
};
tellLoad('load', 'until all is drawn once, coarsely, and picked from once');
await settle(page);
tellLoad('finest', 'until it is as fine as it becomes at rest');
const renderer = await page.evaluate(() => {
  const gl = app.view.renderer.getContext();
  return gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL);
});
tell('drawn by', renderer);

for (const [name, only] of [
  ['hover', 'all'],
  ['hover on points', 'points'],
]) {
  const times_ms = await hoverTimes(page, only);
  tell(name, `${median(times_ms).toFixed(1)} ms, at most ${Math.max(...times_ms).toFixed(1)} ms`);
}

await page.evaluate(() => {
  Object.assign(app.view, { movedAt_ms: Infinity, moved() {} }); // it moves from now on
  app.switchLayer('dense', true);
});
await framesOfPage(page, 4); // these find out how much to draw
const frame_ms = median(await framesOfPage(page, FRAMES));
const [level, levels] = await page.evaluate(() => [app.view.level, app.view.levels.length]);
tell('frame while orbiting', `${frame_ms.toFixed(0)} ms (level ${level} of 0 to ${levels - 1})`);
await browser.close();
