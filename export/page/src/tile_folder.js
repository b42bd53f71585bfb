// A folder that the user picks, in place of a server: its files by their addresses.

// No request ever leaves for it. A folder's name, as paths are put behind it with a slash.
const BASE = 'https://folder.invalid/picked/';

// The files of an input of a folder, by their paths in it.
export function filesByPath(list) {
  return new Map(
    [...list].map((file) => [file.webkitRelativePath.split('/').slice(1).join('/'), file]),
  );
}

// Addresses of the tilesets, those that lie highest: what lies below is a part of them.
export function tilesetsIn(files) {
  const depth = (path) => path.split('/').length;
  const paths = [...files.keys()].filter((path) => /(^|\/)tileset\.json$/.test(path));
  const highest = Math.min(...paths.map(depth));
  return paths
    .filter((path) => depth(path) === highest)
    .sort()
    .map((path) => new URL(path.split('/').map(encodeURIComponent).join('/'), BASE).href);
}

// As fetch(), from the files.
export function fetcherOf(files) {
  return async (url) => {
    const path = decodeURIComponent(new URL(url).href.slice(BASE.length));
    const file = files.get(path);
    if (!file) throw new Error(`${path}: not in the folder`);
    return new Response(file);
  };
}
