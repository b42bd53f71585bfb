// Opens pages in headless Chromium, without a network, drawn by software.
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const { chromium } = createRequire(join(process.env.SLCMAP_NODE_MODULES, 'index.js'))(
  'playwright-core',
);

export async function launch() {
  return chromium.launch({
    executablePath: process.env.SLCMAP_CHROMIUM,
    args: [
      '--headless=new',
      '--no-sandbox',
      '--use-angle=swiftshader',
      '--enable-unsafe-swiftshader',
    ],
  });
}

// Opens a file and waits until the map is shown. Returns the page, whose `said` are errors and
// warnings on the console and whose `requested` is all that was asked for.
export async function open(browser, file, options = {}) {
  const context = await browser.newContext({
    offline: true,
    viewport: { width: 1000, height: 700 },
    colorScheme: 'dark',
    ...options,
  });
  const page = await context.newPage();
  page.setDefaultTimeout(0); // drawing by software takes its time; the test as a whole has a limit
  Object.assign(page, { said: [], requested: [] });
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) page.said.push(message.text());
  });
  page.on('pageerror', (error) => page.said.push(String(error)));
  page.on('request', (request) => page.requested.push(request.url()));
  await page.goto(pathToFileURL(file).href);
  await page.evaluate(async () => {
    window.app = await window.slcmap;
  });
  return page;
}

// The next frame that is drawn with everything in it.
export async function settle(page) {
  await page.evaluate(async () => {
    const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
    do await frame();
    while (app.view.isMoving() || app.view.waiting || app.view.timing);
  });
}

// The canvas as text, to compare.
export async function picture(page) {
  return page.evaluate(() => {
    app.view.draw(performance.now());
    return app.view.canvas.toDataURL();
  });
}

// The share of the canvas' pixels that are not of the background.
export async function drawnShare(page) {
  return page.evaluate(() => {
    app.view.draw(performance.now());
    const gl = app.view.renderer.getContext();
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let drawn = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      // The corner is background.
      if ([0, 1, 2].some((k) => Math.abs(pixels[i + k] - pixels[k]) > 12)) drawn++;
    }
    return drawn / (width * height);
  });
}

// Looks from a place to another, relative to the page's origin.
export async function lookFrom(page, place, target) {
  await page.evaluate(
    ({ place, target }) => {
      const { space } = app.view.controls;
      space.object.position.set(...place);
      space.target.set(...target);
      space.update();
      app.view.invalidate();
    },
    { place, target },
  );
  await settle(page);
}
