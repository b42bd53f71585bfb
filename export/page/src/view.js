// The canvas: cameras, how one moves, and when what is drawn how finely.
import {
  Box3,
  Color,
  MOUSE,
  OrthographicCamera,
  PerspectiveCamera,
  Plane,
  Scene,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

const FIELD_DEG = 34;
const ELEVATION_DEG = 50;
const AZIMUTHS_DEG = [-60, -120, -30, -150, -70, -20, 60, 120, 30, 150]; // from its heading
const FILLED = 0.84; // of the canvas, by what is fitted
const STILL_MS = 160; // after the last movement everything is drawn
const SLOW_MS = 45; // a frame; then less is drawn while moving
const QUICK_MS = 18;
const LONG_MS = 400; // a frame at rest; then less is drawn at rest too

// How finely is drawn: pixels a pixel of the screen, and a share of the points.
const LEVELS = [
  { scale: 1, share: 1 },
  { scale: 1, share: 0.3 },
  { scale: 0.5, share: 0.1 },
  { scale: 0.5, share: 0.03 },
];
// Where the processor draws, several samples a pixel cost three times the time, in each frame: there
// they are left to frames at rest, whose pixels the browser averages.
const LEVELS_BY_PROCESSOR = [{ scale: 2, share: 1 }, ...LEVELS];
const MOST_PER_PIXEL = 2;

export class View {
  // Throws where the browser has no WebGL 2.
  constructor(canvas) {
    this.canvas = canvas;
    this.makeRenderer();
    this.scene = new Scene();
    this.low = new Plane(new Vector3(0, 0, 1), 1e6);
    this.high = new Plane(new Vector3(0, 0, -1), 1e6);
    this.renderer.clippingPlanes = [this.low, this.high];
    this.size = { width: 1, height: 1 };
    this.cameras = { space: new PerspectiveCamera(FIELD_DEG), plan: new OrthographicCamera() };
    this.cameras.space.up.set(0, 0, 1);
    this.mode = 'space';
    this.forgetTimes();
    this.restLevel = this.levels.length - 1;
    this.movedAt_ms = -Infinity;
    this.frames = 0;
    this.onDraw = []; // called with the camera behind each frame
    this.onDetail = () => {}; // called with what is to be drawn how finely
  }

  get camera() {
    return this.cameras[this.mode];
  }

  makeRenderer() {
    const options = { powerPreference: 'high-performance' };
    let context = this.canvas.getContext('webgl2', { ...options, antialias: false });
    this.drawnByProcessor = isByProcessor(context);
    this.levels = this.drawnByProcessor ? LEVELS_BY_PROCESSOR : LEVELS;
    if (context && !this.drawnByProcessor) {
      // Smoothed or not is said when a canvas gets its context: another one.
      context.getExtension('WEBGL_lose_context')?.loseContext();
      context = undefined;
      const smoothed = this.canvas.cloneNode();
      this.canvas.replaceWith(smoothed);
      this.canvas = smoothed;
    }
    const { canvas, drawnByProcessor } = this;
    this.renderer = new WebGLRenderer({ ...options, canvas, context, antialias: !drawnByProcessor });
  }

  // Starts to answer to the pointer; `heading_rad` is that of the building, up in a plan.
  start(heading_rad) {
    this.heading_rad = heading_rad;
    this.cameras.plan.up.set(-Math.sin(heading_rad), Math.cos(heading_rad), 0);
    this.controls = {
      space: this.makeControls('space'),
      plan: this.makeControls('plan'),
    };
    this.controls.space.maxPolarAngle = 0.98 * Math.PI;
    Object.assign(this.controls.plan, {
      enableRotate: false,
      mouseButtons: { LEFT: MOUSE.PAN, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN },
      touches: { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN },
    });
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.resize();
    this.setMode('space');
  }

  makeControls(mode) {
    const controls = new OrbitControls(this.cameras[mode], this.canvas);
    Object.assign(controls, {
      enableDamping: true,
      dampingFactor: 0.14,
      zoomToCursor: true,
      screenSpacePanning: true,
    });
    controls.addEventListener('change', () => this.moved());
    return controls;
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    this.size = { width: Math.max(clientWidth, 1), height: Math.max(clientHeight, 1) };
    this.renderer.setSize(this.size.width, this.size.height);
    const aspect = this.size.width / this.size.height;
    this.cameras.space.aspect = aspect;
    const { plan } = this.cameras;
    const half = 0.5 * (plan.top - plan.bottom);
    Object.assign(plan, { left: -half * aspect, right: half * aspect });
    for (const camera of Object.values(this.cameras)) camera.updateProjectionMatrix();
    this.invalidate();
  }

  setMode(mode) {
    this.mode = mode;
    for (const [name, controls] of Object.entries(this.controls)) controls.enabled = name === mode;
    this.invalidate();
  }

  setBackground(colour) {
    this.scene.background = new Color(colour);
    this.invalidate();
  }

  setSection(low_m, high_m) {
    this.low.constant = -low_m;
    this.high.constant = high_m;
    this.invalidate();
  }

  // Shows points whole: from above and aside, and in the plan. That is no movement by the user.
  fit(points) {
    this.fitSpace(points);
    this.fitPlan(points);
    clearTimeout(this.stillTimer);
    this.movedAt_ms = -Infinity;
    this.invalidate();
  }

  // Of the sides of the building, from that from which it fills most of the canvas.
  fitSpace(points) {
    const camera = this.cameras.space;
    const box = new Box3().setFromPoints(points);
    const views = AZIMUTHS_DEG.map((azimuth_deg) => {
      const away = directionOf(this.heading_rad + radians(azimuth_deg), radians(ELEVATION_DEG));
      return { away, ...this.nearest(camera, box, away, points) };
    });
    const { away, centre, distance_m } = views.reduce((a, b) =>
      b.distance_m < a.distance_m ? b : a,
    );
    camera.position.copy(centre).addScaledVector(away, distance_m);
    camera.near = distance_m / 200;
    camera.far = distance_m * 50;
    camera.updateProjectionMatrix();
    this.controls.space.target.copy(centre);
    this.controls.space.update();
  }

  // The nearest view along a direction that holds points, their middle in the middle: found from
  // afar, where both follow from what is seen almost in proportion.
  nearest(camera, box, away, points) {
    const centre = box.getCenter(new Vector3());
    let distance_m = 4 * Math.max(box.getSize(new Vector3()).length(), 0.1);
    for (let step = 0; step < 12; step++) {
      camera.position.copy(centre).addScaledVector(away, distance_m);
      camera.lookAt(centre);
      camera.updateMatrixWorld();
      const { x, y, extent } = this.extentOf(camera, points);
      const half_m = distance_m * Math.tan(radians(FIELD_DEG / 2));
      centre
        .addScaledVector(axisOf(camera, 0), x * half_m * camera.aspect)
        .addScaledVector(axisOf(camera, 1), y * half_m);
      distance_m *= Math.max(extent / FILLED, 0.5);
    }
    return { centre, distance_m };
  }

  // The middle of points on the canvas, and half their larger extent; 1 is half the canvas.
  extentOf(camera, points) {
    const box = new Box3();
    for (const point of points) box.expandByPoint(point.clone().project(camera));
    const size = box.getSize(new Vector3());
    const { x, y } = box.getCenter(new Vector3());
    return { x, y, extent: 0.5 * Math.max(size.x, size.y) };
  }

  fitPlan(points) {
    const camera = this.cameras.plan;
    const box = new Box3().setFromPoints(points);
    const target = box.getCenter(new Vector3());
    camera.position.copy(target).setZ(box.max.z + 10);
    camera.lookAt(target);
    camera.updateMatrixWorld();
    const seen = points.map((point) => point.clone().applyMatrix4(camera.matrixWorldInverse));
    const middle = new Box3().setFromPoints(seen).getCenter(new Vector3()).setZ(0);
    const half = (axis) => Math.max(...seen.map((point) => Math.abs(point[axis] - middle[axis])));
    const aspect = this.size.width / this.size.height;
    const top = Math.max(half('y'), half('x') / aspect, 1) / FILLED;
    Object.assign(camera, { top, bottom: -top, left: -top * aspect, right: top * aspect });
    Object.assign(camera, { zoom: 1, near: 0.1, far: box.max.z - box.min.z + 20 });
    camera.updateProjectionMatrix();
    const shift = middle.applyQuaternion(camera.quaternion);
    camera.position.add(shift);
    this.controls.plan.target.copy(target).add(shift);
    this.controls.plan.update();
  }

  // Of the plan.
  metresPerPixel() {
    const { plan } = this.cameras;
    return (plan.top - plan.bottom) / plan.zoom / this.size.height;
  }

  // Device pixels that a metre takes at clip-space w = 1.
  pointScale() {
    return (
      0.5 *
      this.camera.projectionMatrix.elements[5] *
      this.size.height *
      this.renderer.getPixelRatio()
    );
  }

  toPixels(point) {
    const { x, y } = point.clone().project(this.camera);
    return new Vector2((0.5 + 0.5 * x) * this.size.width, (0.5 - 0.5 * y) * this.size.height);
  }

  isInFront(point) {
    return point.clone().project(this.camera).z < 1;
  }

  moved() {
    this.movedAt_ms = performance.now();
    clearTimeout(this.stillTimer);
    this.stillTimer = setTimeout(() => this.invalidate(), STILL_MS + 10);
    this.invalidate();
  }

  isMoving() {
    return performance.now() - this.movedAt_ms < STILL_MS;
  }

  // Draws soon, and once.
  invalidate() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now_ms) => {
      this.waiting = false;
      this.controls[this.mode].update();
      this.draw(now_ms);
    });
  }

  draw(now_ms) {
    const moving = this.isMoving();
    if (moving && this.wasMoving) this.adapt(now_ms - this.drawnAt_ms);
    this.wasMoving = moving;
    this.drawnAt_ms = now_ms;
    this.useDetail(this.levels[moving ? this.level : this.restLevel]);
    this.renderer.render(this.scene, this.camera);
    this.frames++;
    for (const call of this.onDraw) call(this.camera);
    if (!moving) this.timeRest();
  }

  useDetail(detail) {
    const scale = detail.scale * Math.min(devicePixelRatio, MOST_PER_PIXEL);
    const ratio = Math.min(scale, MOST_PER_PIXEL);
    if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
    this.onDetail(detail);
  }

  // Draws less while moving where frames take long, more where they do not.
  adapt(frame_ms) {
    this.frame_ms = 0.6 * (this.frame_ms ?? frame_ms) + 0.4 * frame_ms;
    const step = this.frame_ms > SLOW_MS ? 1 : this.frame_ms < QUICK_MS ? -1 : 0;
    const level = Math.min(Math.max(this.level + step, this.leastLevel), this.levels.length - 1);
    if (level > this.level) this.leastLevel = level; // what was too slow once stays out
    if (level !== this.level) this.frame_ms = undefined;
    this.level = level;
  }

  // At rest one frame after the other is finer, until that takes long; the first ones come quickly.
  async timeRest() {
    if (this.timing) return;
    this.timing = true;
    const took_ms = await this.untilDrawn();
    this.timing = false;
    if (!this.warm) {
      // The first frame also compiled and uploaded: it is coarse, and its time says nothing.
      this.warm = true;
      this.restLevel = Math.min(this.restLevel, this.coarsestAtRest());
      this.invalidate();
      return;
    }
    if (took_ms > LONG_MS) {
      this.restLevel = Math.min(this.restLevel + 1, this.coarsestAtRest());
      this.fineEnough = true;
    } else if (this.restLevel > 0 && !this.fineEnough) {
      this.restLevel--;
      this.invalidate();
    }
    const begin = [40, 80, 160].filter((limit_ms) => took_ms > limit_ms).length;
    this.level = Math.max(this.level, begin, this.restLevel);
  }

  // At rest no pixel of the screen is left out.
  coarsestAtRest() {
    return this.levels.findLastIndex(({ scale }) => scale >= 1);
  }

  // Waits until what was asked of the graphics is done, and returns how long that took.
  async untilDrawn() {
    const gl = this.renderer.getContext();
    const from_ms = performance.now();
    const drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (gl.clientWaitSync(drawn, 0, 0) === gl.TIMEOUT_EXPIRED) {
      await new Promise((resolve) => setTimeout(resolve, 2));
    }
    gl.deleteSync(drawn);
    return performance.now() - from_ms;
  }

  // What is drawn is different from now on: how much of it can be, is tried anew.
  forgetTimes() {
    const begin = { level: 0, leastLevel: 0, frame_ms: undefined, fineEnough: false, warm: false };
    Object.assign(this, begin);
  }
}

// Right (0) or up (1) of a camera.
function axisOf(camera, index) {
  return new Vector3().setFromMatrixColumn(camera.matrixWorld, index);
}

function radians(degrees) {
  return (degrees * Math.PI) / 180;
}

function directionOf(azimuth_rad, elevation_rad) {
  return new Vector3(Math.cos(azimuth_rad), Math.sin(azimuth_rad), 0)
    .multiplyScalar(Math.cos(elevation_rad))
    .setZ(Math.sin(elevation_rad));
}

function isByProcessor(context) {
  const info = context?.getExtension('WEBGL_debug_renderer_info');
  const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
}
