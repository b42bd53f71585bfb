// The page of tilesets, served by the program, and opened from a file with a folder that is picked.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { drawnShare, launch } from './browser.mjs';

const folder = process.env.SLCMAP_TILES;
let browser;
let server;
let address;

before(async () => {
  browser = await launch();
  server = spawn(process.env.SLCMAP_PROGRAM, ['view', '--serve', folder, '--port', '0']);
  let said = '';
  address = await new Promise((resolve, reject) => {
    server.stderr.on('data', (text) => {
      said += text;
      const found = /http:\/\/127\.0\.0\.1:\d+\//.exec(said);
      if (found) resolve(found[0]);
    });
    server.on('exit', (code) => reject(new Error(`the server ended with ${code}: ${said}`)));
  });
});

after(async () => {
  await browser.close();
  server.kill();
});

async function newPage(url) {
  const offline = url.startsWith('file:');
  const context = await browser.newContext({ offline, viewport: { width: 1000, height: 700 } });
  const page = await context.newPage();
  page.setDefaultTimeout(0);
  Object.assign(page, { said: [], requested: [] });
  page.on('console', (message) => {
    // The library says so of every tileset of version 1.1.
    const isKnown = message.text().includes('have limited support');
    if (['error', 'warning'].includes(message.type()) && !isKnown) page.said.push(message.text());
  });
  page.on('pageerror', (error) => page.said.push(String(error)));
  page.on('request', (request) => page.requested.push(request.url()));
  await page.goto(url);
  await page.evaluate(async () => {
    window.app = await window.slcmap;
  });
  return page;
}

// All tiles that the view asks for are there.
async function loaded(page) {
  const isLoaded = () => {
    app.view.invalidate();
    const { tiles } = app;
    const isFine = Object.values(tiles.error_px).every((error_px) => error_px < 6.01);
    return app.sets && !tiles.isLoading() && tiles.counts().points > 0 && isFine;
  };
  await page.waitForFunction(isLoaded, null, { polling: 200 });
}

test('a server shows a tileset and asks nobody else', async () => {
  const page = await newPage(address);
  await loaded(page);
  assert.deepEqual(page.said, []);
  assert.ok(page.requested.every((url) => url.startsWith(address) || url.startsWith('data:')));
  const { points, lines } = await page.evaluate(() => app.tiles.counts());
  assert.ok(points > 30000 && points <= 100000, `${points} points`);
  assert.equal(lines, 12);
  assert.ok((await drawnShare(page)) > 0.05);
  const text = await page.locator('#panel').innerText();
  for (const part of ['Dense cloud', 'Lines', 'Walls, floors, pipes']) {
    assert.ok(text.includes(part), `${part} in ${text}`);
  }
  assert.match(text, /Dense cloud\s+100.000\s/);
  await page.context().close();
});

test('a layer that is off is not drawn, and comes back', async () => {
  const page = await newPage(address);
  await loaded(page);
  const box = page.getByLabel('Dense cloud');
  await box.click();
  await page.waitForFunction(() => app.tiles.counts().points === 0);
  await box.click();
  await loaded(page);
  await page.context().close();
});

test('distances between points are measured', async () => {
  const page = await newPage(address);
  await loaded(page);
  await page.getByRole('button', { name: 'Measure' }).click();
  const text = await page.evaluate(() => {
    app.setPicks([app.corners[0], app.corners[0].clone().setX(app.corners[0].x + 4)]);
    return document.getElementById('card').innerText;
  });
  assert.match(text, /4\.000 m/);
  await page.evaluate(() => app.setPicks([]));
  const canvas = await page.locator('#canvas').boundingBox();
  for (const [x, y] of [[0.45, 0.5], [0.55, 0.55]]) {
    await page.mouse.click(canvas.x + x * canvas.width, canvas.y + y * canvas.height);
  }
  const picks = await page.evaluate(() => app.picks.map((point) => point.toArray()));
  assert.equal(picks.length, 2);
  for (const [x, y, z] of picks) {
    assert.ok(x > 99.9 && x < 104.2 && y > 199.9 && y < 205.1 && z > -0.1 && z < 2.7, `${picks}`);
  }
  await page.context().close();
});

test('opened from a file it shows a folder that is picked, without any request', async () => {
  const page = await newPage(pathToFileURL(join(folder, 'index.html')).href);
  assert.ok(await page.getByText('Open a folder of tiles').isVisible());
  await page.locator('#folder').setInputFiles(folder);
  await loaded(page);
  assert.deepEqual(page.said, []);
  assert.equal(page.requested.length, 1);
  assert.ok((await drawnShare(page)) > 0.05);
  await page.context().close();
});

test('a folder without a tileset is named', async () => {
  const page = await newPage(pathToFileURL(join(folder, 'index.html')).href);
  await page.locator('#folder').setInputFiles(join(folder, 'lines'));
  assert.match(await page.locator('#loading').innerText(), /No tileset\.json in this folder/);
  await page.context().close();
});
