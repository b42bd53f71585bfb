// The panel beside the canvas: what is shown, and how.
import { byId, choiceRow, element } from './dom.js';
import { formatArea, formatCoarse, formatCount, formatShare, formatSigma } from './format.js';
import { nameFields, titleOfStorey } from './names.js';
import { AGES, AXES, KINDS, OPENINGS, STATUSES, paletteOf } from './theme.js';

const COLOURINGS = [
  ['axis', 'Direction'],
  ['kind', 'Kind'],
  ['age', 'Age'],
  ['sigma', 'Error'],
];

const WALKED = ['trajectory', 'keyframes', 'pictures']; // drawn in its colour

export function group(title, ...content) {
  return element('section', {}, element('h2', {}, title), ...content);
}

export function toggle(name, count, on, change, colour) {
  const box = element('input', { type: 'checkbox', onchange: () => change(box.checked) });
  box.checked = on;
  const swatch = colour ? [element('i', { class: 'swatch', style: `--colour: ${colour}` })] : [];
  const number = count === null ? [] : [element('span', { class: 'count' }, formatCount(count))];
  return element(
    'label',
    { class: 'toggle' },
    box,
    ...swatch,
    element('span', {}, name),
    ...number,
  );
}

// A choice of one is none.
function several(title, toggles) {
  return toggles.length > 1 ? [element('h3', {}, title), ...toggles] : [];
}

function countBy(codes, until) {
  const counts = new Map();
  for (let i = 0; i < until; i++) counts.set(codes[i], (counts.get(codes[i]) ?? 0) + 1);
  return [...counts].sort(([a], [b]) => a - b);
}

export class Panel {
  constructor(app, container) {
    this.app = app;
    this.container = container;
    this.render();
  }

  // Anew, as colours and units changed.
  render() {
    const { app } = this;
    const close = () => this.setOpen(false);
    this.container.replaceChildren(
      element('button', { id: 'close-panel', type: 'button', onclick: close }, 'Done'),
      this.heading(),
      ...this.storeys(),
      group('Height shown', app.section.element, app.section.text),
      this.lines(),
      group('Layers', ...this.layers()),
      ...this.names(),
      this.settings(),
    );
    app.section.show();
  }

  // On a phone it is a sheet over the map.
  isOpen() {
    return byId('page').classList.contains('open');
  }

  setOpen(open) {
    byId('page').classList.toggle('open', open);
    byId('menu').setAttribute('aria-expanded', String(open));
  }

  heading() {
    const { document } = this.app.map;
    const state = document.complete ? '' : ` · partial: ${document.partial_reason}`;
    return element(
      'header',
      {},
      element('h1', {}, document.title),
      element('p', {}, `slcmap ${document.slcmap} · method ${document.method}${state}`),
      element('p', { class: 'figures' }, this.figures().join(' · ')),
      ...this.place(),
    );
  }

  // Of a map that lies in a grid: where its origin is there.
  place() {
    const place = this.app.map.document.georeference;
    if (!place) return [];
    const [east, north, height] = place.origin_m.map((value) => value.toFixed(2));
    const turn = place.turn_rad === 0 ? '' : `, turned by ${formatAngle(place.turn_rad)}`;
    const text = `Origin in ${place.crs || 'its grid'}: ${east}, ${north}, ${height} m${turn}`;
    return [element('p', { class: 'figures', title: 'georeference' }, text)];
  }

  figures() {
    const { layers, map } = this.app;
    const { seen_share } = map.document;
    const { rooms } = map.document.building;
    const figures = [`${formatCount(layers.lines.data.lines)} lines`];
    if (layers.dense.count > 0) figures.push(`${formatCount(layers.dense.count)} points`);
    if (rooms.length > 0) {
      const area_m2 = rooms.reduce((sum, room) => sum + room.area_m2, 0);
      figures.push(
        `${rooms.length} ${rooms.length > 1 ? 'rooms' : 'room'}, ${formatArea(area_m2)}`,
      );
    }
    if (seen_share !== null) figures.push(`${formatShare(seen_share)} of the surfaces seen`);
    figures.push(`${formatCoarse(layers.trajectory.length_m)} walked`);
    return figures;
  }

  storeys() {
    const { app } = this;
    const { storeys } = app.map.document.building;
    if (storeys.length < 2) return [];
    const choices = [['all', 'All'], ...storeys.map((storey) => [storey.id, titleOfStorey(storey)])];
    this.storeyRow = choiceRow('Storey', choices, app.storey, (storey) => app.showStorey(storey));
    return [group('Storey', this.storeyRow)];
  }

  // Their names changed.
  showStoreys() {
    for (const storey of this.app.map.document.building.storeys) {
      const button = this.storeyRow?.querySelector(`[value="${storey.id}"]`);
      if (button) button.textContent = titleOfStorey(storey);
    }
  }

  names() {
    const { app } = this;
    const { document } = app.map;
    if (document.building.rooms.length === 0) return [];
    const fields = nameFields(document, {
      changed: () => app.showNames(),
      save: () => app.saveNames(),
    });
    fields.open = this.namesAreOpen ?? false; // as it was before the panel was made anew
    fields.addEventListener('toggle', () => {
      this.namesAreOpen = fields.open;
    });
    return [group('Rooms', fields)];
  }

  lines() {
    const { app } = this;
    const { lines, lineFilter } = app.layers;
    const { data } = lines;
    const row = choiceRow('Colour lines by', COLOURINGS, app.layers.colourBy, (by) =>
      app.colourBy(by),
    );
    const marks = data.count - data.lines;
    return group(
      'Lines',
      row,
      ...this.codes('axis', data.axis, AXES, lineFilter.axes),
      ...several('Kinds', this.codes('kind', data.kind, KINDS, lineFilter.kinds)),
      ...several('Headings of the building', this.worlds()),
      ...(marks > 0
        ? [
            toggle('Marks on surfaces', marks, lineFilter.marks, (on) => {
              lineFilter.marks = on;
              app.updateLines();
            }),
          ]
        : []),
    );
  }

  // A toggle for each code that lines have.
  codes(what, codes, names, shown) {
    const { app } = this;
    const palette = paletteOf(app.theme);
    return countBy(codes, app.layers.lines.data.lines).map(([code, count]) => {
      const colour = app.layers.colourBy === what ? palette[what][code] : null;
      return toggle(
        names[code] ?? String(code),
        count,
        shown.has(code),
        (on) => app.showLines(shown, code, on),
        colour,
      );
    });
  }

  worlds() {
    const {
      lines: { data },
      lineFilter: { worlds },
    } = this.app.layers;
    return countBy(data.world, data.lines).map(([world, count]) =>
      toggle(world < 0 ? 'Of none' : `Heading ${world}`, count, worlds.has(world), (on) =>
        this.app.showLines(worlds, world, on),
      ),
    );
  }

  layers() {
    const { app } = this;
    return Object.entries(app.layers.switches)
      .filter(([, { count }]) => count !== 0)
      .map(([key, { name, count, on }]) =>
        toggle(
          name,
          count,
          on,
          (checked) => app.switchLayer(key, checked),
          WALKED.includes(key) ? paletteOf(app.theme).trajectory : null,
        ),
      );
  }

  settings() {
    const { app } = this;
    return group(
      'Page',
      choiceRow(
        'Units',
        [
          ['m', 'Metres'],
          ['ft', 'Feet'],
        ],
        app.units,
        (units) => app.setUnits(units),
      ),
      choiceRow(
        'Theme',
        [
          ['dark', 'Dark'],
          ['light', 'Light'],
        ],
        app.theme,
        (theme) => app.chooseTheme(theme),
      ),
      element(
        'div',
        { class: 'choices' },
        element('button', { type: 'button', onclick: () => app.savePicture() }, 'Save a picture'),
        element('button', { type: 'button', onclick: () => app.print() }, 'Print'),
      ),
    );
  }
}

function legendEntry(name, colour, kind = '') {
  const swatch = element('i', { class: `swatch ${kind}`, style: `--colour: ${colour}` });
  return element('span', {}, swatch, name);
}

// What colours mean, for the corner of the canvas: of lines, openings and the walk.
export function legend(app) {
  const palette = paletteOf(app.theme);
  const { layers } = app;
  const entries = linesLegend(layers, palette);
  const kinds = new Set(layers.openingKinds());
  for (const [kind, name] of Object.entries(OPENINGS)) {
    if (kinds.has(kind)) entries.push(legendEntry(name, palette.opening[kind], 'area'));
  }
  const deviations = layers.isOn('deviations') ? layers.deviations.all : [];
  for (const [status, name] of Object.entries(STATUSES)) {
    if (deviations.some((part) => part.status === status)) {
      entries.push(legendEntry(name, palette.status[status]));
    }
  }
  if (layers.isOn('trajectory') && layers.trajectory.length_m > 0) {
    entries.push(legendEntry('Walk', palette.trajectory));
  }
  return entries;
}

function linesLegend({ lines: { data }, colourBy: by }, palette) {
  if (by === 'sigma') {
    const [low, high] = data.sigmaRange_m.map(formatSigma);
    const ramp = element('i', { class: 'ramp', style: `--ramp: ${palette.scale.join(', ')}` });
    return [element('span', {}, `Lines: ${low}`), ramp, element('span', {}, high)];
  }
  const [codes, names] = {
    axis: [data.axis, AXES],
    kind: [data.kind, KINDS],
    age: [data.recent, AGES],
  }[by];
  return countBy(codes, data.lines).map(([code]) =>
    legendEntry(names[code] ?? '', palette[by][code]),
  );
}
