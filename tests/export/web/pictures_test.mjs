// The page of the room of room_map.h with pictures of keyframes, white at their top right.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, lookFrom, open, settle } from './browser.mjs';

// Of the camera of keyframe 2, which looks up, with x to the right and y, its down, as the world's.
const PLACE = [-0.2, -0.5, 0.2];
const DISTANCE_M = 0.7; // of the picture that is shown
let browser;
let page;

before(async () => {
  browser = await launch();
  page = await open(browser, process.env.SLCMAP_PAGE);
  await lookFrom(page, [-0.2, -0.6, 8], [-0.2, -0.5, 0]);
});

after(() => browser.close());

async function pointAt(place) {
  const { x, y } = await page.evaluate((point) => app.toWindow(point), place);
  await page.mouse.move(x, y);
  await settle(page);
  return { x, y };
}

// Red, green and blue at a place.
async function colourAt(place) {
  return page.evaluate((point) => {
    app.view.draw(performance.now());
    const gl = app.view.renderer.getContext();
    const { x, y } = app.toWindow(point);
    const { left, top, width, height } = app.view.canvas.getBoundingClientRect();
    const pixel = new Uint8Array(4);
    const column = ((x - left) / width) * gl.drawingBufferWidth;
    const row = (1 - (y - top) / height) * gl.drawingBufferHeight;
    gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return [...pixel.slice(0, 3)];
  }, place);
}

async function colourInPicture(right_m, down_m) {
  return colourAt([PLACE[0] + right_m, PLACE[1] + down_m, PLACE[2] + DISTANCE_M]);
}

const shown = () => page.evaluate(() => app.layers.pictures.screen.visible);

test('a keyframe under the pointer shows its picture where it was taken, the right way round', async () => {
  assert.ok(!(await shown()));
  await pointAt(PLACE);
  await page.waitForFunction(() => app.layers.pictures.screen.visible);
  assert.match(await page.locator('#tip').innerText(), /Keyframe 2[^]*0:00.8/);
  const brightest = Math.min(...(await colourInPicture(0.25, -0.25)));
  assert.ok(brightest > 240, `${brightest} at the top right`);
  for (const place of [
    [-0.25, -0.25],
    [0.25, 0.25],
    [-0.25, 0.25],
  ]) {
    const darkest = Math.max(...(await colourInPicture(...place)));
    assert.ok(darkest < 15, `${darkest} at ${place}`);
  }
  await page.mouse.move(40, 300); // on the panel
  assert.ok(!(await shown()));
});

test('a wall that is not where it was planned says by how much, until that is switched off', async () => {
  const waitUntil = (shown) =>
    page.waitForFunction((expected) => {
      const labels = [...document.querySelectorAll('#labels .wall')];
      return labels.some((label) => !label.hidden && label.textContent === '-21 ±4') === expected;
    }, shown);
  await waitUntil(true);
  assert.match(await page.locator('#legend').innerText(), /Deviates/);
  await page.locator('.toggle', { hasText: 'Not as planned' }).click();
  await waitUntil(false);
});

test('complains of nothing and asks for nothing', () => {
  assert.deepEqual(page.said, []);
  assert.equal(page.requested.length, 1);
});

test('the tip and, after a click, the card hold the picture', async () => {
  const { x, y } = await pointAt(PLACE);
  await page.mouse.click(x, y);
  await page.waitForFunction(() => document.querySelector('#card .picture')?.width === 64);
  const pixels = await page.evaluate(() => {
    const context = document.querySelector('#card .picture').getContext('2d');
    return [...context.getImageData(48, 12, 1, 1).data, ...context.getImageData(16, 12, 1, 1).data];
  });
  assert.ok(pixels[0] > 240 && pixels[4] < 15, pixels.join());
  await page.mouse.move(40, 300); // on the panel
  await settle(page);
  assert.ok(await shown(), 'as it is kept');
  await page.keyboard.press('Escape');
  assert.ok(!(await shown()));
});

test('keyframes are neither measured nor, where they are switched off, picked', async () => {
  const pick = (only) =>
    page.evaluate(
      ({ place, which }) => {
        const { left, top } = app.view.canvas.getBoundingClientRect();
        const { x, y } = app.toWindow(place);
        return app.picker.pick(x - left, y - top, which)?.type ?? null;
      },
      { place: PLACE, which: only },
    );
  assert.equal(await pick('all'), 'picture');
  assert.notEqual(await pick('surfaces'), 'picture');
  await page.getByLabel('Pictures3').click();
  assert.notEqual(await pick('all'), 'picture');
  await page.getByLabel('Pictures3').click();
});
