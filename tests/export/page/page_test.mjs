// The page of the room that room_map.h describes, as a user meets it.
import assert from 'node:assert/strict';
import { after, before, beforeEach, test } from 'node:test';
import { drawnShare, launch, open, settle } from './browser.mjs';

const file = process.env.SLCMAP_PAGE;
// Relative to the page's origin, which is the room's middle in whole metres: (102, 203, 1).
const ROOM = { x: [-2, 2], y: [-3, 2], z: [-1, 1.6] };
let browser;
let page;

before(async () => {
  browser = await launch();
  page = await open(browser, file);
});

after(() => browser.close());

beforeEach(async () => {
  await page.evaluate(() => {
    app.pointer.setMeasuring(false);
    app.setMode('space');
    app.showStorey('all');
    app.fit();
  });
  await settle(page);
});

async function pointAt(place, click = false) {
  const { x, y } = await page.evaluate((point) => app.toWindow(point), place);
  await page.mouse.move(x, y);
  if (click) await page.mouse.click(x, y);
  await settle(page);
}

test('opens from a file, asks for nothing and complains of nothing', () => {
  assert.deepEqual(page.said, []);
  assert.equal(page.requested.length, 1);
  assert.match(page.requested[0], /^file:/);
});

test('says what the map holds', async () => {
  const text = await page.locator('#panel').innerText();
  for (const part of ['A made room', '12 lines', '400 points', '1 room, 20.0 m²', '1.90 m walked']) {
    assert.ok(text.includes(part), `${part} in ${text}`);
  }
  const counts = await page.evaluate(() =>
    Object.fromEntries([...document.querySelectorAll('.toggle')].map((row) =>
      [row.querySelector('span').textContent, row.querySelector('.count')?.textContent])));
  const expected = {
    X: '4', Y: '4', Vertical: '4', Edge: '12', 'Marks on surfaces': '1', Walls: '4', Floors: '1',
    Ceilings: '1', Rooms: '1', Points: '4', 'Dense cloud': '400', 'Occupied space': '1', Keyframes: '5',
    'World 0': '7', 'World 1': '1', 'Of none': '4',
  };
  for (const [name, count] of Object.entries(expected)) assert.equal(counts[name], count, name);
});

test('names the line under the pointer', async () => {
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]); // on the lower edge at the far side
  const tip = await page.locator('#tip').innerText();
  for (const part of ['Line 11', '4.000 m', '7 keyframes', '3.0 mm', 'Edge', 'X, world 0']) {
    assert.ok(tip.includes(part), `${part} in ${tip}`);
  }
  await pointAt([0, 0, 60]); // in the sky
  assert.ok(await page.locator('#tip').isHidden());
});

test('names a wall with its door', async () => {
  await pointAt([ROOM.x[0], 0.4, 0.3]);
  assert.match(await page.locator('#tip').innerText(), /Wall 2[^]*13\.0 m²[^]*4\.0 mm/);
  const area_m2 = await page.evaluate(() => app.layers.planes.all[3].area_m2);
  assert.ok(Math.abs(area_m2 - (13 - 0.9 * 2)) < 1e-4, `${area_m2} m²`);
});

test('a layer that is off draws nothing and cannot be picked', async () => {
  const with_lines = await page.evaluate(() => app.layers.lines.fat.geometry.instanceCount);
  await page.getByLabel('X4').click();
  const without = await page.evaluate(() => app.layers.lines.fat.geometry.instanceCount);
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]);
  const tip = await page.locator('#tip').innerText();
  await page.getByLabel('X4').click();
  assert.equal(with_lines - without, 4);
  assert.ok(!tip.includes('Line 11'), tip);
});

test('themes differ, and follow the system', async () => {
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const dark = await background();
  await page.locator('#theme').click();
  const light = await background();
  await page.locator('#theme').click();
  const other = await open(browser, file, { colorScheme: 'light' });
  const system = await other.evaluate(() => getComputedStyle(document.body).backgroundColor);
  await other.close();
  assert.equal(dark, 'rgb(14, 18, 23)');
  assert.equal(light, 'rgb(244, 243, 239)');
  assert.equal(system, light);
});

test('a section removes what is above it', async () => {
  const whole = await drawnShare(page);
  await page.getByLabel('Upper cut').fill('-0.9');
  const cut = await drawnShare(page);
  assert.ok(whole > 0.1 && cut < 0.9 * whole, `${whole} and ${cut}`);
});
