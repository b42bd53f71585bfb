// What people call the building, its storeys, rooms and doors: edited here and saved as names.yaml,
// which the program takes with --names.
import { element } from './dom.js';

const OVER_FLOOR_M = 1;

export function titleOfRoom({ id, name }) {
  return name || `Room ${id + 1}`;
}

export function titleOfStorey({ id, name }) {
  return name || String(id);
}

// In the coordinates of the file of names; `frame` holds where the page's axes end there, and its
// origin.
function placeOf({ frame }, [x, y, z]) {
  const [ex, ey, ez, origin] = frame;
  const value = (i) =>
    origin[i] + (ex[i] - origin[i]) * x + (ey[i] - origin[i]) * y + (ez[i] - origin[i]) * z;
  return `[${[0, 1, 2].map((i) => value(i).toFixed(3)).join(', ')}]`;
}

function placeInRoom({ place, floor_m }) {
  return [place.x, place.y, floor_m + OVER_FLOOR_M];
}

function placeOfOpening(wall, { from_m, to_m }, storeys) {
  const [dx, dy] = [0, 1].map((i) => wall.end[i] - wall.start[i]);
  const share = (0.5 * (from_m + to_m)) / Math.hypot(dx, dy);
  const { floor_m } = storeys.find(({ id }) => id === wall.storey);
  return [wall.start[0] + share * dx, wall.start[1] + share * dy, floor_m + OVER_FLOOR_M];
}

// All names there are, each with its place: ids differ from map to map.
export function namesAsYaml({ names, building }) {
  const { rooms, storeys, walls } = building;
  const entry = (name, place) => `  - {name: ${JSON.stringify(name)}, at: ${placeOf(names, place)}}`;
  const list = (key, entries) => (entries.length > 0 ? [`${key}:`, ...entries] : []);
  const named = (parts) => parts.filter(({ name }) => name);
  const roomOf = ({ id }) => rooms.find(({ storey }) => storey === id);
  const doors = walls.flatMap((wall) =>
    named(wall.openings).map((door) => entry(door.name, placeOfOpening(wall, door, storeys))),
  );
  return [
    ...(names.crs ? [`crs: ${JSON.stringify(names.crs)}`] : []),
    ...list('buildings', building.name && rooms.length > 0 ? [entry(building.name, placeInRoom(rooms[0]))] : []),
    ...list('storeys', named(storeys).filter(roomOf).map((storey) => entry(storey.name, placeInRoom(roomOf(storey))))),
    ...list('rooms', named(rooms).map((room) => entry(room.name, placeInRoom(room)))),
    ...list('doors', doors),
    '',
  ].join('\n');
}

function nameField(part, title, change) {
  const input = element('input', {
    type: 'text',
    value: part.name,
    placeholder: title,
    'aria-label': `Name of ${title}`,
    maxlength: 80,
    onchange: () => {
      part.name = input.value.trim();
      change();
    },
  });
  return input;
}

// A field for each name, and a button that saves them.
export function nameFields({ building }, { changed, save }) {
  const { rooms, storeys } = building;
  return element(
    'details',
    { class: 'names' },
    element('summary', {}, 'Names'),
    nameField(building, 'the building', changed),
    ...storeys.map((storey) => nameField(storey, `Storey ${storey.id}`, changed)),
    ...rooms.map((room) => nameField(room, `Room ${room.id + 1}`, changed)),
    element('button', { type: 'button', onclick: save }, 'Save names.yaml'),
  );
}
