// The page: its state, and what follows from a change of it.
import { Box3, Vector3 } from 'three';
import { byId, element } from './dom.js';
import { composePicture, printPicture, saveBlob, savePicture } from './save.js';
import { Describer } from './describe.js';
import { formatArea, formatLength, formatShare, roundLength, useFeet } from './format.js';
import { Labels } from './labels.js';
import { Layers } from './layers.js';
import { LineHighlight } from './lines.js';
import { Measure } from './measure.js';
import { namesAsYaml, titleOfRoom } from './names.js';
import { Panel, legend } from './panel.js';
import { Picker } from './picker.js';
import { Pointer } from './pointer.js';
import { Section } from './section.js';
import { initialTheme, paletteOf, storeTheme } from './theme.js';
import { View } from './view.js';

const BELOW_CEILING_M = 0.3; // the upper cut, so that one sees into rooms
const BELOW_FLOOR_M = 0.15;
const USUAL_HEIGHT_M = 2.5; // of a storey whose ceiling was not seen
const SCALE_BAR_PX = 140;
const NUMBERED_WALL_PX = 60;
const WHOLLY_SEEN = 0.85; // of its border; what is missing there is doors and corners
const WELL_HELD = 0.8; // of the surfaces that were seen, of which nothing is said

export class App {
  constructor(map) {
    this.map = map;
    this.theme = initialTheme();
    this.units = 'm';
    this.storey = 'all';
    this.view = new View(byId('canvas'));
    this.layers = new Layers(map, this.view.scene);
    this.extent = this.layers.extent();
    this.section = this.makeSection();
    this.labels = new Labels(this.view, byId('labels'));
    this.picker = new Picker(this.view, this.layers, this.section);
    this.describer = new Describer(map, this.layers);
    this.measure = new Measure(this.view, this.labels, this.layers);
    this.hovered = new LineHighlight();
    this.view.scene.add(this.hovered.object);
    this.addRoomNames();
    this.addWallNumbers();
    this.addDeviations();
    this.panel = new Panel(this, byId('panel'));
    this.start();
  }

  start() {
    const { view, layers } = this;
    view.onDetail = (detail) => layers.setDetail(detail, view.pointScale());
    view.onDraw.push(() => this.showScale());
    view.start(this.map.document.building.heading_rad);
    this.setTheme(this.theme);
    for (const [name, { on }] of Object.entries(layers.switches)) layers.switchLayer(name, on);
    this.showStorey('all');
    view.fit(this.extent);
    this.pointer = new Pointer(this);
    // Behind the first frame, while that is drawn.
    requestAnimationFrame(() => setTimeout(() => layers.lineIndex.build()));
  }

  makeSection() {
    const { storeys } = this.map.document.building;
    const zero_m = storeys.length > 0 ? storeys[0].floor_m : 0;
    const { min, max } = new Box3().setFromPoints(this.extent);
    const above = storeys.length > 0 ? `above floor ${storeys[0].id}` : 'in the map';
    return new Section(min.z - 0.5, max.z + 0.5, { zero_m, above }, (low_m, high_m) =>
      this.view.setSection(low_m, high_m),
    );
  }

  // In the plan, where walls are long enough on the screen.
  addWallNumbers() {
    for (const wall of this.map.document.building.walls.filter(({ place }) => place)) {
      const isShown = () => {
        if (this.view.mode !== 'plan' || !this.layers.isOn('plan')) return false;
        const [a, b] = wall.ends.map((end) => this.view.toPixels(end));
        return a.distanceTo(b) > NUMBERED_WALL_PX && this.section.holds(wall.place);
      };
      this.labels.add(wall.place, isShown, { class: 'wall' }, `W${wall.id}`);
    }
  }

  // By how much walls are not where they were planned, in millimetres, where that can be read.
  addDeviations() {
    for (const { place, ends, text } of this.layers.deviations.all) {
      const isShown = () => {
        const [a, b] = ends.map((end) => this.view.toPixels(end));
        return (
          this.layers.isOn('deviations') &&
          a.distanceTo(b) > NUMBERED_WALL_PX &&
          this.section.holds(place)
        );
      };
      this.labels.add(place, isShown, { class: 'wall' }, text);
    }
  }

  addRoomNames() {
    for (const room of this.layers.rooms.rooms) {
      const isShown = () =>
        this.layers.isOn('rooms') &&
        this.section.holds(room.place.clone().setZ(room.floor_m + 0.05));
      const area = element('span', {}, areaText(room));
      room.label = this.labels.add(room.place, isShown, { class: 'room' }, titleOfRoom(room), area);
    }
  }

  // Fields of names were changed.
  showNames() {
    for (const room of this.layers.rooms.rooms) {
      room.label.element.firstChild.textContent = titleOfRoom(room);
    }
    this.panel.showStoreys();
    this.view.invalidate();
  }

  saveNames() {
    const text = namesAsYaml(this.map.document);
    saveBlob(new Blob([text], { type: 'application/yaml' }), 'names.yaml');
  }

  showStorey(storey) {
    this.storey = storey;
    const { storeys } = this.map.document.building;
    const shown = storeys.filter(({ id }) => storey === 'all' || String(id) === String(storey));
    const [least, most] = this.section.range;
    if (shown.length === 0) {
      this.section.set(least, most);
    } else {
      const top = shown[shown.length - 1];
      const ceiling_m = top.ceiling_m ?? top.floor_m + USUAL_HEIGHT_M;
      const low_m = storey === 'all' ? least : shown[0].floor_m - BELOW_FLOOR_M;
      this.section.set(low_m, ceiling_m - BELOW_CEILING_M);
    }
    this.panel.storeyRow?.select(storey);
  }

  setMode(mode) {
    this.view.setMode(mode);
    this.switchLayer('plan', mode === 'plan');
    byId('space').setAttribute('aria-checked', String(mode === 'space'));
    byId('plan').setAttribute('aria-checked', String(mode === 'plan'));
    byId('scale').hidden = mode !== 'plan';
    this.panel.render();
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    const palette = paletteOf(theme);
    this.view.setBackground(palette.background);
    this.layers.setPalette(palette);
    this.hovered.setColour(palette.highlight);
    this.measure.line.setColour(palette.measure);
    this.refresh();
  }

  chooseTheme(theme) {
    storeTheme(theme);
    this.setTheme(theme);
  }

  setUnits(units) {
    this.units = units;
    useFeet(units === 'ft');
    for (const room of this.layers.rooms.rooms) {
      room.label.element.lastChild.textContent = areaText(room);
    }
    this.pointer.showCard();
    if (this.measure.result?.distance_m !== undefined) {
      this.measure.label.element.textContent = formatLength(this.measure.result.distance_m);
    }
    this.refresh();
  }

  refresh() {
    this.panel.render();
    byId('legend').replaceChildren(...legend(this));
    this.view.invalidate();
  }

  colourBy(by) {
    this.layers.colourBy = by;
    this.updateLines();
    this.refresh();
  }

  showLines(set, code, on) {
    if (on) set.add(code);
    else set.delete(code);
    this.updateLines();
  }

  updateLines() {
    this.layers.updateLines(paletteOf(this.theme));
    this.view.invalidate();
  }

  switchLayer(name, on) {
    this.layers.switchLayer(name, on);
    byId('legend').replaceChildren(...legend(this));
    this.view.forgetTimes();
    this.view.invalidate();
  }

  toggleLayer(name) {
    this.switchLayer(name, !this.layers.isOn(name));
    this.panel.render();
  }

  fit() {
    this.view.fit(this.extent);
  }

  // Highlights what is under the pointer: of lines all pieces, of keyframes their picture.
  highlight(pick) {
    const ends = pick?.type === 'line' ? this.endsOf(pick) : [];
    this.hovered.show(ends);
    const { pictures } = this.layers;
    if (pick?.type === 'picture') pictures.show(pick.index).then(() => this.view.invalidate());
    else pictures.hide();
    this.view.invalidate();
  }

  endsOf({ index }) {
    const { data } = this.layers.lines;
    return data
      .piecesOf(index)
      .flatMap((piece) => [...data.ends.subarray(6 * piece, 6 * piece + 6)]);
  }

  // Everything that is seen, as a canvas of its own.
  picture() {
    this.view.draw(performance.now());
    return composePicture(this);
  }

  savePicture() {
    savePicture(this.picture(), this.map.document.title);
  }

  // In light colours, and then as it was.
  print() {
    const { theme } = this;
    this.setTheme('light');
    printPicture(this.picture());
    this.setTheme(theme);
  }

  showScale() {
    if (this.view.mode !== 'plan') return;
    const metresPerPixel = this.view.metresPerPixel();
    const { metres, name } = roundLength(SCALE_BAR_PX * metresPerPixel);
    byId('scale').style.width = `${metres / metresPerPixel}px`;
    byId('scale').textContent = name;
  }

  // Where a point relative to the page's origin is in the window, in pixels.
  toWindow(point) {
    const { left, top } = this.view.canvas.getBoundingClientRect();
    const { x, y } = this.view.toPixels(new Vector3(...point));
    return { x: x + left, y: y + top };
  }
}

function areaText({ area_m2, bounded, seen_share }) {
  const area = `${bounded < WHOLLY_SEEN ? 'about ' : ''}${formatArea(area_m2)}`;
  const isLittle = seen_share !== null && seen_share < WELL_HELD;
  return isLittle ? `${area}, ${formatShare(seen_share)} of what was seen` : area;
}
