// The page of the room that room_map.h describes, as a user meets it.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, beforeEach, test } from 'node:test';
import { drawnShare, launch, lookFrom, open, picture, settle } from './browser.mjs';

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
  await lookFrom(page, [7, -9, 9], [0, 0, 0]);
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
  for (const part of [
    'A made room',
    '12 lines',
    '400 points',
    '1 room, 19.8 m²',
    '1.90 m walked',
  ]) {
    assert.ok(text.includes(part), `${part} in ${text}`);
  }
  const counts = await page.evaluate(() =>
    Object.fromEntries(
      [...document.querySelectorAll('.toggle')].map((row) => [
        row.querySelector('span').textContent,
        row.querySelector('.count')?.textContent,
      ]),
    ),
  );
  const expected = {
    'Along the building': '4',
    'Across the building': '4',
    Upright: '4',
    Edge: '11',
    Unknown: '1',
    'Marks on surfaces': '1',
    Walls: '4',
    Floors: '1',
    Ceilings: '1',
    Rooms: '1',
    Points: '4',
    'Dense cloud': '400',
    'Occupied space': '1',
    Keyframes: '5',
    'Heading 0': '7',
    'Heading 1': '1',
    'Of none': '4',
  };
  for (const [name, count] of Object.entries(expected)) assert.equal(counts[name], count, name);
  assert.ok(!('Pictures' in counts));
});

test('names the line under the pointer', async () => {
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]); // on the lower edge at the far side
  const tip = await page.locator('#tip').innerText();
  for (const part of ['Line 11', '4.000 m', '7 views', '3.0 mm', 'Edge', 'Along the building, heading 0']) {
    assert.ok(tip.includes(part), `${part} in ${tip}`);
  }
  await pointAt([0, 0, 60]); // in the sky
  assert.ok(await page.locator('#tip').isHidden());
});

test('names a wall with its door', async () => {
  await pointAt([ROOM.x[0], 0.4, 0.3]);
  assert.match(await page.locator('#tip').innerText(), /Wall plane 2[^]*13\.0 m²[^]*4\.0 mm/);
  const area_m2 = await page.evaluate(() => app.layers.planes.all[3].area_m2);
  assert.ok(Math.abs(area_m2 - (13 - 0.9 * 2)) < 1e-4, `${area_m2} m²`);
});

test('a floor ends at the holes of its room', async () => {
  const area_m2 = await page.evaluate(() => app.layers.planes.all[0].area_m2);
  assert.ok(Math.abs(area_m2 - 19.75) < 1e-4, `${area_m2} m²`);
  await lookFrom(page, [0, -1, 9], [0, -0.9, 0]);
  await pointAt([1.45, -1.6, ROOM.z[0]]);
  assert.match(await page.locator('#tip').innerText(), /Floor 0/);
  await pointAt([1.45, -2.25, ROOM.z[0]]); // in the pillar
  const tip = await page.locator('#tip').evaluate((shown) => (shown.hidden ? '' : shown.innerText));
  assert.equal(tip, '');
});

test('a layer that is off draws nothing and cannot be picked', async () => {
  const with_lines = await page.evaluate(() => app.layers.lines.wide.count);
  await page.getByLabel('Along the building4').click();
  const without = await page.evaluate(() => app.layers.lines.wide.count);
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]);
  const tip = await page.locator('#tip').innerText();
  await page.getByLabel('Along the building4').click();
  assert.equal(with_lines - without, 4);
  assert.ok(!tip.includes('Line 11'), tip);
});

// Colours of the column of pixels through a place, as text, from the canvas' lower border.
async function columnThrough(place) {
  return page.evaluate((point) => {
    app.view.draw(performance.now());
    const gl = app.view.renderer.getContext();
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const pixels = new Uint8Array(4 * height);
    const { left } = app.view.canvas.getBoundingClientRect();
    const x = ((app.toWindow(point).x - left) / app.view.size.width) * width;
    gl.readPixels(Math.floor(x), 0, 1, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return Array.from({ length: height }, (_, y) => pixels.slice(4 * y, 4 * y + 3).join());
  }, place);
}

const X_COLOUR = '255,111,97'; // dark, #ff6f61

async function onlyLines(run) {
  const names = await page.evaluate(() => {
    const on = Object.keys(app.layers.switches).filter((name) => app.layers.isOn(name));
    for (const name of on) app.switchLayer(name, false);
    return on;
  });
  await run();
  await page.evaluate((on) => on.forEach((name) => app.switchLayer(name, true)), names);
}

test('draws lines two pixels wide', () =>
  onlyLines(async () => {
    await lookFrom(page, [0, -9, 0], [0, 0, 0]);
    const column = await columnThrough([0, ROOM.y[0], ROOM.z[0]]);
    const ratio = await page.evaluate(() => app.view.renderer.getPixelRatio());
    const nearest = column.slice(0, Math.floor(column.length / 2)); // its lower half
    const count = nearest.filter((colour) => colour === X_COLOUR).length;
    // One edge there is of the near wall, one of the far one.
    assert.ok(Math.abs(count - 2 * 2 * ratio) <= 2, `${count} pixels at ${ratio} a pixel`);
  }));

test('draws what is before the camera of a line that begins behind it', () =>
  onlyLines(async () => {
    await lookFrom(page, [0, ROOM.y[0], -0.9], [2, ROOM.y[0], -0.9]);
    const column = await columnThrough([1, ROOM.y[0], ROOM.z[0]]);
    assert.ok(column.includes(X_COLOUR), 'line 10');
    assert.ok(column.indexOf(X_COLOUR) < column.length / 2, 'below the horizon');
  }));

test('draws every pixel at rest, however long that takes', async () => {
  await settle(page);
  assert.ok((await page.evaluate(() => app.view.renderer.getPixelRatio())) >= 1);
});

test('is not moved by being fitted', async () => {
  await settle(page);
  await page.evaluate(() => app.fit());
  assert.ok(!(await page.evaluate(() => app.view.isMoving())));
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

const CORNER = [ROOM.x[0], ROOM.y[0], ROOM.z[0]]; // of the lower edges
const CARD = '#card-rows';

async function measured(first, second) {
  await pointAt(first, true);
  await pointAt(second, true);
  return page.locator(CARD).innerText();
}

test('measures between parallel lines', async () => {
  await page.keyboard.press('m');
  const text = await measured([0, ROOM.y[0], ROOM.z[0]], [ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]);
  const sigma_mm = Math.hypot(3, 3);
  for (const part of [
    '5.000 m',
    `± ${(1.96 * sigma_mm).toFixed(1)} mm`,
    `1 σ: ${sigma_mm.toFixed(1)} mm`,
    'parallel',
  ]) {
    assert.ok(text.includes(part), `${part} in ${text}`);
  }
  assert.equal(await page.locator('.distance').innerText(), '5.000 m');
});

test('measures between points: ends of lines', async () => {
  await page.keyboard.press('m');
  await page.locator('#pick-points').click();
  const text = await measured(CORNER, [ROOM.x[1], ROOM.y[1], ROOM.z[0]]);
  await page.locator('#pick-surfaces').click();
  assert.ok(text.includes('6.403 m'), text); // 4 m by 5 m
});

test('shows a plan, to scale, in which lines are named', async () => {
  await page.keyboard.press('2');
  await settle(page);
  const ends = await page.evaluate(() =>
    [
      [-2, -3, -1],
      [2, -3, -1],
    ].map((point) => app.toWindow(point)),
  );
  const scale = await page
    .locator('#scale')
    .evaluate((bar) => ({ width: bar.offsetWidth, text: bar.textContent }));
  const metres =
    (parseFloat(scale.text) / scale.width) *
    Math.hypot(ends[1].x - ends[0].x, ends[1].y - ends[0].y);
  assert.ok(Math.abs(metres - 4) < 0.1, `${metres} m`);
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]]);
  assert.match(await page.locator('#tip').innerText(), /Line 1[13]/); // one edge is above the other
  assert.ok(await page.evaluate(() => app.layers.isOn('plan')));
});

test('names rooms with their area, in feet too', async () => {
  assert.match(await page.locator('.room').innerText(), /Room 1\s*19.8 m²/);
  await page.getByRole('radio', { name: 'Feet' }).click();
  assert.match(await page.locator('.room').innerText(), /213 ft²/);
  await page.getByRole('radio', { name: 'Metres' }).click();
});

test('occupied space, the dense cloud and keyframes are drawn when they are switched on', async () => {
  await lookFrom(page, [2, 0, 3], [0.5, 0.5, -1]);
  for (const key of ['o', 'd', 'k']) {
    const without = await picture(page);
    await page.keyboard.press(key);
    assert.notEqual(await picture(page), without, key);
    await page.keyboard.press(key);
  }
});

test('colours lines by kind, age and sigma', async () => {
  const colours = new Set();
  for (const name of ['Direction', 'Kind', 'Age', 'Error']) {
    await page.getByRole('radio', { name, exact: true }).click();
    colours.add(
      await page.evaluate(() => app.layers.lines.wide.texels[3]), // of the first line
    );
  }
  assert.equal(colours.size, 4);
  assert.match(await page.locator('#legend').innerText(), /3.0 mm/);
  await page.getByRole('radio', { name: 'Direction', exact: true }).click();
});

test('names the wall of a plane by its number, with its thickness', async () => {
  const { title, rows } = await page.evaluate(() =>
    app.describer.describe({ type: 'plane', plane: app.layers.planes.all[3] }),
  );
  assert.equal(title, 'Wall 0');
  assert.deepEqual(Object.fromEntries(rows).Thickness, '0.120 m');
});

test('walls of the plan are behind their faces, with the swing of a door before them', async () => {
  const [wall, swing] = await page.evaluate(() => {
    const reach = ({ geometry }) => {
      geometry.computeBoundingBox();
      return [geometry.boundingBox.min.x, geometry.boundingBox.max.x];
    };
    const { object, openings } = app.layers.walls;
    return [reach(object.children[0]), reach(openings[0].object)];
  });
  const close = (found, expected) =>
    found.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) < 1e-3, `${found}`));
  close(wall, [2, 2.12]); // the room ends at x = 2
  close(swing, [2 - 0.9, 2]);
});

test('asks for the second pick of a measurement', async () => {
  await page.keyboard.press('m');
  const prompt = () => page.locator('#prompt').innerText();
  assert.equal(await prompt(), 'Pick the first line or wall');
  await pointAt([0, ROOM.y[0], ROOM.z[0]], true);
  assert.equal(await prompt(), 'Now pick the second line or wall');
  await pointAt([ROOM.x[0] + 1, ROOM.y[1], ROOM.z[0]], true);
  assert.match(await prompt(), /measure anew/);
});

test('the legend tells the walk and the doors, in their colours', async () => {
  const text = await page.locator('#legend').innerText();
  for (const part of ['Along the building', 'Door', 'Walk']) assert.ok(text.includes(part), text);
  const colours = await page.evaluate(() =>
    [...document.querySelectorAll('#legend .swatch')].map((i) => i.style.getPropertyValue('--colour')),
  );
  assert.equal(new Set(colours).size, colours.length);
  await page.evaluate(() => app.switchLayer('trajectory', false));
  assert.ok(!(await page.locator('#legend').innerText()).includes('Walk'));
  await page.evaluate(() => app.switchLayer('trajectory', true));
});

test('saves a picture, and prints one', async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('s')]);
  assert.equal(download.suggestedFilename(), 'A made room.png');
  const printed = await page.evaluate(
    () =>
      new Promise((resolve) => {
        window.print = () => resolve(document.getElementById('paper').naturalWidth);
        app.print();
      }),
  );
  assert.ok(printed >= 600, `${printed} pixels`);
});

test('names are edited and saved with their places', async () => {
  await page.locator('.names summary').click();
  const field = page.getByLabel('Name of Room 1');
  await field.click();
  await page.keyboard.type('Mess "2"'); // s saves no picture there
  await page.keyboard.press('Tab');
  assert.equal(await page.locator('#labels .room').evaluate((l) => l.firstChild.textContent), 'Mess "2"');
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    page.getByText('Save names.yaml').click(),
  ]);
  assert.equal(download.suggestedFilename(), 'names.yaml');
  const text = readFileSync(await download.path(), 'utf8');
  const found = text.match(/^rooms:\n  - \{name: "Mess \\"2\\"", at: \[(.*), (.*), 1\.000\]\}\n$/);
  assert.ok(found, text);
  const [x, y] = [Number(found[1]), Number(found[2])];
  assert.ok(x > 100 && x < 104 && y > 200 && y < 205, text); // in the map's world
  await field.fill('');
  await page.locator('.names summary').click();
});

test('a storey is shown from its floor to below its ceiling', async () => {
  const [low, high] = await page.evaluate(() => {
    app.showStorey('0');
    return [app.section.low_m, app.section.high_m];
  });
  assert.ok(low > ROOM.z[0] - 0.2 && low < ROOM.z[0]);
  assert.ok(high > 1 && high < ROOM.z[1]);
});

test('on a phone a tap keeps what is known of a line, and layers open', async () => {
  const phone = await open(browser, file, {
    viewport: { width: 390, height: 800 },
    hasTouch: true,
    isMobile: true,
  });
  assert.match(await phone.locator('#hint').innerText(), /One finger turns/);
  await lookFrom(phone, [12, -15, 15], [0, 0, 0]);
  const { x, y } = await phone.evaluate(() => app.toWindow([0, -3, -1]));
  await phone.touchscreen.tap(x, y);
  assert.match(await phone.locator('#card').innerText(), /Line 10/);
  await phone.locator('#menu').tap();
  assert.ok(await phone.locator('#panel').isVisible());
  await phone.locator('#close-panel').tap();
  assert.ok(!(await phone.locator('#panel').isVisible()));
  await phone.locator('#menu').tap();
  await phone.touchscreen.tap(195, 200); // on the map beside it
  assert.ok(!(await phone.locator('#panel').isVisible()));
  assert.deepEqual(phone.said, []);
  await phone.close();
});
