// Colours of the two themes. Interface colours are in styles.css; these are of what is drawn.
import { Color } from 'three';

export const AXES = [
  'Along the building',
  'Across the building',
  'Upright',
  'Other direction',
  'Sloped',
];
export const KINDS = ['Unknown', 'Edge', 'Edge', 'Mark', 'Pipe'];
export const AGES = ['Older', 'Seen last'];
export const STATUSES = { deviates: 'Deviates', missing: 'Missing', new: 'New' };
export const OPENINGS = { door: 'Door', window: 'Window', passage: 'Passage' };

const DARK = {
  background: '#0e1217',
  plane: { wall: '#3d4857', floor: '#202934', ceiling: '#2b3440', other: '#343e4b' },
  planeEdge: '#667382',
  opening: { door: '#c98d5a', window: '#7fd0ff', passage: '#9aa7b5' },
  room: '#7fb4ff',
  poche: '#aeb9c6',
  status: { deviates: '#ff8a5c', missing: '#ff4d6d', new: '#56d68b' },
  axis: ['#ff6f61', '#56d68b', '#6aa5ff', '#f2b84b', '#c490ff'],
  kind: ['#8b97a6', '#e8edf3', '#4fd0c8', '#a58b6b', '#ff8fb3'],
  age: ['#5d6b7c', '#ffd166'],
  scale: ['#4fd0c8', '#9be07a', '#ffd166', '#ff8a5c', '#ff4d6d'],
  trajectory: '#ff5fd8',
  keyframe: '#ff5fd8',
  point: '#9fb0c4',
  voxel: '#51657d',
  pipe: '#d98c8c',
  dense: [0.1, 0.95],
  highlight: '#ffffff',
  measure: '#ffd166',
};

const LIGHT = {
  background: '#f4f3ef',
  plane: { wall: '#e3e0d8', floor: '#fbfaf8', ceiling: '#edebe5', other: '#dbd8cf' },
  planeEdge: '#b3aea2',
  opening: { door: '#7a4a1d', window: '#1677b8', passage: '#7d8590' },
  room: '#2f6fd0',
  poche: '#3b4048',
  status: { deviates: '#d9622b', missing: '#c2183c', new: '#1f8f4e' },
  axis: ['#d5402f', '#1f8f4e', '#2262d6', '#b4780a', '#8a3fd1'],
  kind: ['#8d939b', '#20262e', '#0e8a83', '#a58657', '#c93a70'],
  age: ['#aab0b8', '#c2570c'],
  scale: ['#0e8a83', '#5f9e2f', '#d39a10', '#d9622b', '#c2183c'],
  trajectory: '#c01892',
  keyframe: '#c01892',
  point: '#7b8794',
  voxel: '#b6bcc4',
  pipe: '#c98a8a',
  dense: [0.02, 0.82],
  highlight: '#000000',
  measure: '#c2183c',
};

export function paletteOf(theme) {
  return theme === 'dark' ? DARK : LIGHT;
}

// The theme that the user chose in this browser, else that of the system.
export function initialTheme() {
  const chosen = storedTheme();
  if (chosen) return chosen;
  return matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
}

// A page opened from a file may be refused its storage.
function storedTheme() {
  try {
    const stored = localStorage.getItem('slcmap-theme');
    return stored === 'dark' || stored === 'light' ? stored : null;
  } catch {
    return null;
  }
}

export function storeTheme(theme) {
  try {
    localStorage.setItem('slcmap-theme', theme);
  } catch {
    // Then it is asked of the system again next time.
  }
}

// The colour at a place in [0, 1] of a scale.
export function scaleColour(scale, place) {
  const at = Math.min(Math.max(place, 0), 1) * (scale.length - 1);
  const below = Math.min(Math.floor(at), scale.length - 2);
  return new Color(scale[below]).lerp(new Color(scale[below + 1]), at - below);
}
