// Tilesets (OGC 3D Tiles): what of them is loaded and drawn, within what a computer can bear.
import { ImplicitTilingPlugin } from '3d-tiles-renderer/core/plugins';
import { TilesRenderer } from '3d-tiles-renderer/three';
import { Box3, Group, LineBasicMaterial, Matrix4, PointsMaterial } from 'three';

const FINEST_PX = 6; // of error: points of our tilesets are a quarter of it apart
const COARSEST_PX = 400; // one begins with it: something is seen soon
const STEP = 1.15; // between errors that are tried
const POINT_M = 0.02;
const SMALLEST_POINT_PX = 1.5;
const CACHE_BYTES = [120e6, 160e6]; // of loaded tiles; browser and graphics hold each once more
// How much is drawn at once where the processor draws, and where there is graphics hardware.
const BUDGETS = [
  { points: 1e6, lines: 1e5 },
  { points: 4e6, lines: 1e6 },
];

export class TileSets {
  // `changed` is called where there is something new to draw, `failed(error)` where a file cannot
  // be loaded.
  constructor(view, { changed, failed }) {
    this.view = view;
    this.changed = changed;
    this.failed = failed;
    this.budget = BUDGETS[view.drawnByProcessor ? 0 : 1];
    this.object = new Group();
    this.renderers = [];
    this.hidden = new Set();
    this.shown = new Map(); // parts of visible tiles: how many points, lines
    this.error_px = { points: COARSEST_PX, lines: COARSEST_PX };
    this.forgetTooFine();
    this.materials = { points: pointMaterial(), lines: new LineBasicMaterial({ vertexColors: true }) };
  }

  // Opens tilesets by their addresses. The first says where all lie: what is drawn is in its frame.
  async open(urls, fetcher = (url, options) => fetch(url, options)) {
    this.close();
    const opened = await Promise.all(urls.map((url) => this.openOne(url, fetcher)));
    const first = matrixOf(opened[0].root);
    for (const { group } of this.renderers) {
      first.clone().invert().decompose(group.position, group.quaternion, group.scale);
      group.updateMatrixWorld(true);
    }
    this.infos = opened;
    return opened;
  }

  openOne(url, fetcher) {
    const renderer = new LayeredTiles(url, this);
    renderer.registerPlugin(new ImplicitTilingPlugin());
    renderer.registerPlugin({ fetchData: fetcher });
    [renderer.lruCache.minBytesSize, renderer.lruCache.maxBytesSize] = CACHE_BYTES;
    for (const camera of Object.values(this.view.cameras)) renderer.setCamera(camera);
    for (const type of ['needs-update', 'needs-render']) renderer.addEventListener(type, this.changed);
    renderer.addEventListener('load-model', ({ scene, url: from }) => this.dress(scene, layerOf(from)));
    renderer.addEventListener('tile-visibility-change', (event) => this.count(event));
    this.renderers.push(renderer);
    this.object.add(renderer.group);
    return new Promise((resolve, reject) => {
      renderer.addEventListener('load-root-tileset', ({ tileset }) => resolve(tileset));
      renderer.addEventListener('load-error', ({ error, url: from }) => {
        reject(error);
        this.failed(new Error(`${from}: ${error.message}`));
      });
      renderer.update();
    });
  }

  close() {
    for (const renderer of this.renderers) {
      this.object.remove(renderer.group);
      renderer.dispose();
    }
    this.renderers = [];
    this.shown.clear();
  }

  switchLayer(name, on) {
    if (on) this.hidden.delete(name);
    else this.hidden.add(name);
    this.forgetTooFine();
    this.changed();
  }

  // Materials of our own, one for all tiles.
  dress(scene, layer) {
    scene.traverse((part) => {
      if (part.isPoints) part.material = this.materials.points;
      if (part.isLineSegments) part.material = this.materials.lines;
      if (!part.isMesh) return;
      // So that points and lines on a wall are seen.
      Object.assign(part.material, { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 });
    });
    scene.userData.layer = layer;
  }

  count({ scene, visible }) {
    scene?.traverse((part) => {
      if (!part.isPoints && !part.isLineSegments) return;
      if (!visible) this.shown.delete(part);
      else this.shown.set(part, part.geometry.index?.count ?? part.geometry.attributes.position.count);
    });
  }

  counts() {
    const counts = { points: 0, lines: 0 };
    for (const [part, count] of this.shown) {
      if (part.isPoints) counts.points += count;
      else counts.lines += count / 2;
    }
    return counts;
  }

  isLoading() {
    return this.renderers.some(({ stats }) => stats.downloading + stats.parsing + stats.queued > 0);
  }

  // Before each frame: chooses tiles, and how finely they are drawn, see View.
  update({ share }) {
    const { camera, renderer: canvas } = this.view;
    for (const tiles of this.renderers) {
      for (const other of Object.values(this.view.cameras)) {
        if (other === camera) tiles.setCamera(camera);
        else tiles.deleteCamera(other);
      }
      tiles.setResolutionFromRenderer(camera, canvas);
      tiles.update();
    }
    for (const [part, count] of this.shown) {
      if (part.isPoints) part.geometry.setDrawRange(0, Math.ceil(share * count));
    }
    if (this.view.isMoving()) this.forgetTooFine();
    const counts = this.counts();
    for (const kind of ['points', 'lines']) this.keepBudget(kind, counts[kind]);
  }

  // Allows more error where too much is drawn, less where there is room: not while tiles are on
  // their way, in small steps where much is drawn, and not back to what was too much.
  keepBudget(kind, count) {
    const used = count / this.budget[kind];
    const before = this.error_px[kind];
    let error_px = before;
    if (used > 1) {
      this.tooFine_px[kind] = before;
      error_px = Math.min(STEP * before, COARSEST_PX);
    } else if (count > 0 && used < 0.5 && !this.isLoading()) {
      const finest_px = Math.max(FINEST_PX, STEP * this.tooFine_px[kind]);
      error_px = Math.min(before, Math.max(before / (used < 0.1 ? 2 : STEP), finest_px));
    }
    this.error_px[kind] = error_px;
    if (error_px !== before) this.changed();
  }

  // Another view may bear what was too much in the last one.
  forgetTooFine() {
    this.tooFine_px = { points: 0, lines: 0 };
  }

  // What all that was opened lies in, in the frame of what is drawn.
  box() {
    const box = new Box3();
    for (const tiles of this.renderers) {
      const own = new Box3();
      const turn = new Matrix4();
      if (!tiles.getOrientedBoundingBox(own, turn)) continue;
      box.union(own.applyMatrix4(turn.premultiply(tiles.group.matrixWorld)));
    }
    return box;
  }
}

// Tiles whose errors are shares of what is allowed: clouds and lines each have their own budget.
class LayeredTiles extends TilesRenderer {
  constructor(url, sets) {
    super(url);
    this.sets = sets;
    this.errorTarget = 1;
  }

  // Tiles of layers that are off are as if out of sight: they are not loaded either. The first tile
  // of a layer is always drawn.
  calculateTileViewError(tile, target) {
    super.calculateTileViewError(tile, target);
    const layer = tile.content?.uri?.split('/')[0];
    if (this.sets.hidden.has(layer)) target.inView = false;
    const kind = layer === 'lines' ? 'lines' : 'points';
    target.error = isFirst(tile) ? Infinity : target.error / this.sets.error_px[kind];
  }
}

function isFirst(tile) {
  return !tile.parent?.parent || Boolean(tile.parent.implicitTiling);
}

function layerOf(url) {
  return decodeURIComponent(url).split('/').at(-2);
}

function matrixOf({ transform }) {
  return transform ? new Matrix4().fromArray(transform) : new Matrix4();
}

// Of two centimetres, and never smaller than can be seen.
function pointMaterial() {
  const material = new PointsMaterial({ vertexColors: true, size: POINT_M });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      '#include <logdepthbuf_vertex>',
      `gl_PointSize = clamp(gl_PointSize, ${SMALLEST_POINT_PX.toFixed(1)}, 12.0);`,
    );
  };
  return material;
}
