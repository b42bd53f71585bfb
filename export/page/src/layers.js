// Everything that is drawn of a map, and which of it is switched on.
import { Box3, Vector3 } from 'three';
import { LineIndex } from './line_index.js';
import { LineData, LineLayer } from './lines.js';
import { PipeLayer } from './pipes.js';
import { Planes } from './planes.js';
import { Deviations, RoomLayer, WallPlan } from './plan.js';
import { Pictures } from './pictures.js';
import { DenseCloud, Landmarks } from './points.js';
import { TrajectoryLayer } from './trajectory.js';
import { VoxelLayer } from './voxels.js';

export class Layers {
  constructor(map, scene) {
    const { building } = map.document;
    this.map = map;
    this.lines = new LineLayer(new LineData(map));
    this.lineIndex = new LineIndex(this.lines.data);
    this.landmarks = new Landmarks(map);
    this.dense = new DenseCloud(map);
    this.pipes = new PipeLayer(map);
    this.planes = new Planes(building.planes);
    this.rooms = new RoomLayer(building.rooms);
    this.walls = new WallPlan(building);
    this.deviations = new Deviations(map.document);
    this.voxels = new VoxelLayer(map);
    this.trajectory = new TrajectoryLayer(map);
    this.pictures = new Pictures(map);
    this.parts = [
      this.lines,
      this.landmarks,
      this.dense,
      this.pipes,
      this.planes,
      this.rooms,
      this.walls,
      this.deviations,
      this.voxels,
      this.trajectory,
      this.pictures,
    ];
    for (const { object } of this.parts) scene.add(object);
    this.lineFilter = this.everyLine();
    this.colourBy = 'axis';
    this.switches = this.makeSwitches();
  }

  // What lines are shown by: each set holds what is switched on.
  everyLine() {
    const { axis, kind, world } = this.lines.data;
    return { axes: new Set(axis), kinds: new Set(kind), worlds: new Set(world), marks: false };
  }

  // Of whole layers: name, how many there are, and what is switched.
  makeSwitches() {
    const plane = (kind) => this.planes.layers[kind];
    const some = this.planes.all.length > 0;
    return {
      walls: {
        name: 'Walls',
        count: this.planes.count('wall'),
        object: plane('wall').object,
        on: true,
      },
      floors: {
        name: 'Floors',
        count: this.planes.count('floor'),
        object: plane('floor').object,
        on: true,
      },
      ceilings: {
        name: 'Ceilings',
        count: this.planes.count('ceiling'),
        object: plane('ceiling').object,
        on: false,
      },
      others: {
        name: 'Other planes',
        count: this.planes.count('other'),
        object: plane('other').object,
        on: false,
      },
      rooms: { name: 'Rooms', count: this.rooms.rooms.length, object: this.rooms.object, on: true },
      pipes: { name: 'Pipes', count: this.pipes.count, object: this.pipes.object, on: true },
      plan: {
        name: 'Walls as in a plan',
        count: this.walls.count,
        object: this.walls.object,
        on: false,
      },
      deviations: {
        name: 'Not as planned',
        count: this.deviations.all.length,
        object: this.deviations.object,
        on: true,
      },
      landmarks: {
        name: 'Points',
        count: this.landmarks.count,
        object: this.landmarks.object,
        on: !some,
      },
      dense: { name: 'Dense cloud', count: this.dense.count, object: this.dense.object, on: false },
      voxels: {
        name: 'Occupied space',
        count: this.voxels.count,
        object: this.voxels.object,
        on: false,
      },
      trajectory: { name: 'Walk (trajectory)', count: null, object: this.trajectory.way, on: true },
      keyframes: {
        name: 'Keyframes',
        count: this.trajectory.keyframeCount,
        object: this.trajectory.keyframes,
        on: false,
      },
      pictures: {
        name: 'Pictures',
        count: this.pictures.count,
        object: this.pictures.object,
        on: this.pictures.count > 0,
      },
    };
  }

  // Of the openings that are drawn.
  openingKinds() {
    const { walls, plan } = this.switches;
    const drawn = [
      ...(walls.on ? this.planes.all : []),
      ...(plan.on ? this.map.document.building.walls : []),
    ];
    return drawn.flatMap(({ openings }) => openings.map(({ kind }) => kind));
  }

  isOn(name) {
    return this.switches[name].on;
  }

  switchLayer(name, on) {
    this.switches[name].on = on;
    this.switches[name].object.visible = on;
  }

  isLineShown(index) {
    const { data } = this.lines;
    const { axes, kinds, worlds, marks } = this.lineFilter;
    const isOfKind = data.isMark(index) ? marks : kinds.has(data.kind[index]);
    return isOfKind && axes.has(data.axis[index]) && worlds.has(data.world[index]);
  }

  updateLines(palette) {
    this.lines.update((index) => this.isLineShown(index), this.colourBy, palette);
  }

  setPalette(palette) {
    for (const part of this.parts) part.setPalette?.(palette);
    this.updateLines(palette);
  }

  // Draws as finely as asked, see View.
  setDetail({ share }, pointScale_px) {
    this.dense.useShare(share);
    this.dense.setScale(pointScale_px);
    this.landmarks.setScale(pointScale_px);
  }

  // Points about what the map is mostly of: corners of its planes, else the box of its lines without
  // the farthest.
  extent() {
    const corners = this.planes.all
      .filter(({ kind }) => kind !== 'other')
      .flatMap(({ outline }) => outline.map((point) => new Vector3(...point)));
    if (corners.length > 0) return corners;
    const box = new Box3();
    expandByMost(box, this.lines.data.ends);
    if (box.isEmpty()) expandByMost(box, this.map.arrays.trajectory_positions);
    if (box.isEmpty()) box.expandByPoint(new Vector3());
    const { min, max } = box.expandByScalar(0.5);
    return [min.x, max.x].flatMap((x) =>
      [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new Vector3(x, y, z))),
    );
  }
}

// All but the lowest and highest hundredth of each coordinate.
function expandByMost(box, coordinates) {
  if (coordinates.length === 0) return;
  const corners = [0, 1, 2].map((axis) => {
    const values = coordinates.filter((_, i) => i % 3 === axis).sort();
    const margin = Math.floor(values.length / 100);
    return [values[margin], values[values.length - 1 - margin]];
  });
  for (const which of [0, 1])
    box.expandByPoint(new Vector3(...corners.map((corner) => corner[which])));
}
