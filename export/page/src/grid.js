// Where points are in the grid that a map lies in.

// Rows of name and value for a point of the map's world; none of a map that has no place.
export function rowsInGrid(place, [x, y, z]) {
  if (!place) return [];
  const [east, north, height] = place.origin_m;
  const along = place.scale * Math.cos(place.turn_rad);
  const across = place.scale * Math.sin(place.turn_rad);
  const found = [east + along * x - across * y, north + across * x + along * y, height + z];
  const name = place.crs || 'Its grid';
  return [[`${name} (E, N, height)`, `${found.map((value) => value.toFixed(3)).join(', ')} m`]];
}
