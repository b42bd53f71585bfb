// Finds lines near the pointer.
import { BufferAttribute, BufferGeometry } from 'three';
import { LineSegmentsBVH, INTERSECTED, NOT_INTERSECTED } from 'three-mesh-bvh';

export class LineIndex {
  constructor(data) {
    this.data = data;
  }

  // It takes a while, for which the first picture need not wait.
  build() {
    if (this.tree || this.data.count === 0) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.data.ends, 3));
    this.tree = new LineSegmentsBVH(geometry, { indirect: true });
  }

  // Calls visit(index) for each line that may be in the cone: those that are in boxes that it meets.
  visitNear(cone, visit) {
    this.build();
    if (!this.tree) return;
    this.tree.shapecast({
      intersectsBounds: (box) => (cone.meetsBox(box) ? INTERSECTED : NOT_INTERSECTED),
      intersectsLine: (line, entry) => {
        visit(this.tree.resolvePrimitiveIndex(entry));
        return false;
      },
    });
  }
}
