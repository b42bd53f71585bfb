// The page of tilesets: what is open, what is shown of it, distances between points.
import { Box3, Raycaster, Vector2, Vector3 } from 'three';
import { byId, choiceRow, element } from './dom.js';
import { formatLength } from './format.js';
import { rowsInGrid } from './grid.js';
import { Labels } from './labels.js';
import { LineHighlight } from './lines.js';
import { rowTable } from './measure.js';
import { group, toggle } from './panel.js';
import { Section } from './section.js';
import { fetcherOf, filesByPath, tilesetsIn } from './tile_folder.js';
import { TileSets } from './tile_sets.js';
import { initialTheme, paletteOf, storeTheme } from './theme.js';
import { View } from './view.js';

const LAYERS = {
  dense: 'Dense cloud',
  filled: 'Filled in on planes',
  points: 'Points',
  lines: 'Lines',
  structure: 'Walls, floors, pipes',
};
const OFF_AT_FIRST = ['points', 'filled'];
const BELOW_CEILING_M = 0.3; // the upper cut, so that one sees into rooms
const BELOW_FLOOR_M = 0.15;
const USUAL_HEIGHT_M = 2.5;
const REACH_M = 0.05; // of a point from the ray of the pointer
const CLICK_PX = 5;

export class TilesApp {
  constructor() {
    this.view = new View(byId('canvas'));
    this.theme = initialTheme();
    this.tiles = new TileSets(this.view, {
      changed: () => this.view.invalidate(),
      failed: (error) => this.say(`Not all can be shown: ${error.message}`),
    });
    this.view.scene.add(this.tiles.object);
    this.labels = new Labels(this.view, byId('labels'));
    this.picks = [];
    this.between = new LineHighlight();
    this.view.scene.add(this.between.object);
    this.distance = this.labels.add(new Vector3(), () => this.picks.length === 2, { class: 'distance' });
    this.view.onDetail = (detail) => this.tiles.update(detail);
    this.view.start(0);
    this.view.fit(cornersOf(new Box3(new Vector3(-5, -5, 0), new Vector3(5, 5, 5)))); // until more is known
    this.setTheme(this.theme);
    this.listen();
  }

  say(text) {
    byId('loading').hidden = text === '';
    byId('loading').textContent = text;
  }

  askForFolder() {
    this.say('');
    byId('choose').hidden = false;
  }

  async openFolder(list) {
    const files = filesByPath(list);
    const urls = tilesetsIn(files);
    if (urls.length > 0) return this.openUrls(urls, fetcherOf(files));
    this.say('No tileset.json in this folder: pick one that slcmap export --format tiles wrote.');
  }

  async openUrls(urls, fetcher) {
    byId('choose').hidden = true;
    this.say('Loading');
    try {
      this.sets = await this.tiles.open(urls, fetcher);
    } catch (error) {
      this.say(`The tiles cannot be shown: ${error.message}`);
      return;
    }
    this.say('');
    this.showAll();
  }

  showAll() {
    const layers = this.sets.flatMap(({ root }) => root.children ?? []);
    this.layers = Object.keys(LAYERS).filter((name) =>
      layers.some(({ extras }) => extras?.layer === name),
    );
    const many = this.layers.some((name) => !OFF_AT_FIRST.includes(name));
    this.tiles.hidden = new Set(many ? OFF_AT_FIRST : []);
    this.storeys = this.sets.length === 1 ? (this.sets[0].extras?.storeys ?? []) : [];
    const box = this.tiles.box();
    this.corners = cornersOf(box);
    const zero_m = this.storeys[0]?.floor_m ?? 0;
    const above = this.storeys.length > 0 ? `above floor ${this.storeys[0].id}` : 'in the map';
    this.section = new Section(box.min.z - 0.5, box.max.z + 0.5, { zero_m, above }, (low_m, high_m) =>
      this.view.setSection(low_m, high_m),
    );
    this.renderPanel();
    this.showStorey('all');
    this.view.fit(this.corners);
  }

  renderPanel() {
    const { extras } = this.sets[0];
    const title = this.sets.length > 1 ? `${this.sets.length} maps` : (extras?.map ?? 'Tiles');
    document.title = `${title} · slcmap`;
    const choices = [['all', 'All'], ...this.storeys.map(({ id }) => [id, String(id)])];
    this.storeyRow = choiceRow('Storey', choices, 'all', (storey) => this.showStorey(storey));
    byId('panel').replaceChildren(
      element('button', { id: 'close-panel', type: 'button', onclick: () => this.setOpen(false) }, 'Done'),
      element('header', {}, element('h1', {}, title)),
      ...(this.storeys.length > 1 ? [group('Storey', this.storeyRow)] : []),
      group('Height shown', this.section.element, this.section.text),
      group('Layers', ...this.layers.map((name) => this.layerToggle(name))),
    );
    this.section.show();
  }

  layerToggle(name) {
    const tiles = this.sets.flatMap(({ root }) => root.children ?? []);
    const counts = tiles
      .filter(({ extras }) => extras?.layer === name)
      .map(({ extras }) => extras.points ?? extras.lines);
    const count = counts.includes(undefined) ? null : counts.reduce((sum, own) => sum + own, 0);
    const change = (on) => this.tiles.switchLayer(name, on);
    return toggle(LAYERS[name], count, !this.tiles.hidden.has(name), change);
  }

  showStorey(storey) {
    const [least, most] = this.section.range;
    const shown = this.storeys.filter(({ id }) => storey === 'all' || String(id) === String(storey));
    const top = shown.at(-1);
    const high_m = top ? (top.ceiling_m ?? top.floor_m + USUAL_HEIGHT_M) - BELOW_CEILING_M : most;
    this.section.set(storey === 'all' ? least : shown[0].floor_m - BELOW_FLOOR_M, high_m);
    this.storeyRow.select(storey);
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    const palette = paletteOf(theme);
    this.view.setBackground(palette.background);
    this.between.setColour(palette.measure);
  }

  setMode(mode) {
    this.view.setMode(mode);
    byId('space').setAttribute('aria-checked', String(mode === 'space'));
    byId('plan').setAttribute('aria-checked', String(mode === 'plan'));
  }

  setOpen(open) {
    byId('page').classList.toggle('open', open);
    byId('menu').setAttribute('aria-expanded', String(open));
  }

  setMeasuring(on) {
    this.measuring = on;
    byId('measure').setAttribute('aria-pressed', String(on));
    byId('measure-bar').hidden = !on;
    this.setPicks([]);
  }

  listen() {
    const actions = {
      space: () => this.setMode('space'),
      plan: () => this.setMode('plan'),
      measure: () => this.setMeasuring(!this.measuring),
      fit: () => this.corners && this.view.fit(this.corners),
      theme: () => {
        this.setTheme(this.theme === 'dark' ? 'light' : 'dark');
        storeTheme(this.theme);
      },
      menu: () => this.setOpen(!byId('page').classList.contains('open')),
      close: () => this.setPicks([]),
    };
    for (const [id, action] of Object.entries(actions)) byId(id).addEventListener('click', action);
    const { canvas } = this.view;
    canvas.addEventListener('pointerdown', (event) => {
      byId('hint').hidden = true;
      this.pressed = { x: event.clientX, y: event.clientY };
    });
    canvas.addEventListener('pointerup', ({ clientX, clientY }) => {
      const { x, y } = this.pressed ?? { x: Infinity, y: Infinity };
      const isClick = Math.hypot(clientX - x, clientY - y) < CLICK_PX;
      if (this.measuring && isClick) this.pick(clientX, clientY);
    });
  }

  // A third begins anew.
  pick(clientX, clientY) {
    const at = this.pointAt(clientX, clientY);
    if (at) this.setPicks(this.picks.length === 2 ? [at] : [...this.picks, at]);
  }

  // The nearest to the ray of the points and lines' ends that are drawn, in what the cuts leave.
  pointAt(clientX, clientY) {
    const { left, top } = this.view.canvas.getBoundingClientRect();
    const { width, height } = this.view.size;
    const raycaster = new Raycaster();
    const place = new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
    raycaster.setFromCamera(place, this.view.camera);
    Object.assign(raycaster.params, { Points: { threshold: REACH_M }, Line: { threshold: REACH_M } });
    const hits = raycaster.intersectObjects([...this.tiles.shown.keys()], false);
    return hits.find(({ point }) => this.section.holds(point))?.point;
  }

  setPicks(picks) {
    this.picks = picks;
    const prompts = ['Pick the first point', 'Now pick the second point', 'Pick another to measure anew'];
    byId('prompt').textContent = prompts[picks.length];
    const [from, to] = picks;
    byId('card').hidden = picks.length === 0;
    byId('card-title').textContent = to ? 'Between two points' : 'Point';
    this.between.show(to ? [...from, ...to] : []);
    byId('card-rows').replaceChildren(rowTable([...this.rowsBetween(), ...this.rowsOfPlaces()]));
    this.view.invalidate();
  }

  rowsBetween() {
    const [from, to] = this.picks;
    if (!to) return [];
    const apart = new Vector3().subVectors(to, from);
    const text = formatLength(apart.length());
    this.distance.position.addVectors(from, to).multiplyScalar(0.5);
    this.distance.element.textContent = text;
    return [
      ['Distance', text],
      ['Horizontally', formatLength(Math.hypot(apart.x, apart.y))],
      ['In height', formatLength(Math.abs(apart.z))],
    ];
  }

  // All that is drawn is in the frame of the first map.
  rowsOfPlaces() {
    const place = this.sets?.[0].extras?.georeference;
    return this.picks.flatMap((point) => rowsInGrid(place, point.toArray()));
  }
}

function cornersOf({ min, max }) {
  const box = new Box3(min, max);
  return [0, 1, 2, 3, 4, 5, 6, 7].map(
    (bits) =>
      new Vector3(
        ...['x', 'y', 'z'].map((axis, i) => (bits >> i & 1 ? box.max[axis] : box.min[axis])),
      ),
  );
}
