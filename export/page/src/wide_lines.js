// Lines that are some pixels wide, each as two triangles of one draw. An instance a line, as in
// three.js' own wide lines, takes three times as long where a processor draws.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  FloatType,
  Mesh,
  RGBAFormat,
  ShaderMaterial,
  Vector4,
} from 'three';

const PER_ROW = 1024; // lines of two texels each: every browser has textures 2048 wide
const CORNERS = [0, 2, 1, 1, 2, 3]; // two at the start, two at the end

const VERTEX = `
  uniform highp sampler2D lines; // of each line two texels: start and colour, end
  uniform vec2 viewport_px;
  uniform float width_px;
  varying vec3 vColour;
  #include <clipping_planes_pars_vertex>
  void main() {
    int line = gl_VertexID >> 2;
    ivec2 place = ivec2(2 * (line % ${PER_ROW}), line / ${PER_ROW});
    vec4 first = texelFetch(lines, place, 0);
    vec4 second = texelFetch(lines, place + ivec2(1, 0), 0);
    vec4 start = modelViewMatrix * vec4(first.xyz, 1.0);
    vec4 end = modelViewMatrix * vec4(second.xyz, 1.0);
    vec4 clipStart = projectionMatrix * start;
    vec4 clipEnd = projectionMatrix * end;

    // What is behind the near plane has no place on the canvas: the line ends at the plane.
    float startDepth = clipStart.z + clipStart.w;
    float endDepth = clipEnd.z + clipEnd.w;
    if (startDepth * endDepth < 0.0) {
      float cut = startDepth / (startDepth - endDepth);
      vec4 cutAt = mix(start, end, cut);
      if (startDepth < 0.0) {
        start = cutAt;
        clipStart = projectionMatrix * cutAt;
      } else {
        end = cutAt;
        clipEnd = projectionMatrix * cutAt;
      }
    }

    vec2 way_px = (clipEnd.xy / clipEnd.w - clipStart.xy / clipStart.w) * viewport_px;
    vec2 along = dot(way_px, way_px) > 0.0 ? normalize(way_px) : vec2(1.0, 0.0);
    bool atEnd = (gl_VertexID & 2) != 0;
    vec2 aside = ((gl_VertexID & 1) != 0 ? 1.0 : -1.0) * vec2(-along.y, along.x);
    vec4 mvPosition = atEnd ? end : start;
    gl_Position = atEnd ? clipEnd : clipStart;
    gl_Position.xy += (aside + (atEnd ? along : -along)) * width_px / viewport_px * gl_Position.w;
    vColour = vec3((ivec3(first.w) >> ivec3(16, 8, 0)) & 255) / 255.0;
    #include <clipping_planes_vertex>
  }`;

const FRAGMENT = `
  varying vec3 vColour;
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    gl_FragColor = vec4(vColour, 1.0);
  }`;

const viewport = new Vector4();

function lineMaterial(texture, width_px) {
  return new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    clipping: true,
    uniforms: {
      lines: { value: texture },
      viewport_px: { value: [1, 1] },
      width_px: { value: width_px },
    },
  });
}

export class WideLines {
  constructor(width_px) {
    this.count = 0;
    this.material = lineMaterial(null, width_px);
    this.object = new Mesh(new BufferGeometry(), this.material);
    this.object.frustumCulled = false;
    this.object.onBeforeRender = (renderer) => {
      renderer.getViewport(viewport);
      this.material.uniforms.viewport_px.value = [viewport.z, viewport.w];
      this.material.uniformsNeedUpdate = true;
    };
    this.reserve(1);
  }

  // Room for so many lines.
  reserve(capacity) {
    const rows = Math.ceil(capacity / PER_ROW);
    if (rows <= this.rows) return;
    this.rows = rows;
    this.texels = new Float32Array(8 * PER_ROW * rows);
    this.texture?.dispose();
    this.texture = new DataTexture(this.texels, 2 * PER_ROW, rows, RGBAFormat, FloatType);
    this.material.uniforms.lines.value = this.texture;
    const corners = new Uint32Array(CORNERS.length * PER_ROW * rows);
    for (let i = 0, line = 0; i < corners.length; line++) {
      for (const corner of CORNERS) corners[i++] = 4 * line + corner;
    }
    this.object.geometry.dispose();
    this.object.geometry = new BufferGeometry().setIndex(new BufferAttribute(corners, 1));
  }

  // Shows the lines at `count` places in `order` among pairs of ends, x, y, z of one and the other;
  // colourOf(index) is a number such as 0xff0000.
  show(ends, order, count, colourOf) {
    this.reserve(count);
    this.count = count;
    for (let k = 0; k < count; k++) {
      const from = 6 * order[k];
      const to = 8 * k;
      for (let j = 0; j < 3; j++) {
        this.texels[to + j] = ends[from + j];
        this.texels[to + 4 + j] = ends[from + 3 + j];
      }
      this.texels[to + 3] = colourOf(order[k]);
    }
    this.texture.needsUpdate = true;
    this.object.geometry.setDrawRange(0, CORNERS.length * count);
  }

  // All of some lines, in one colour.
  showAll(ends, colour) {
    const order = Array.from({ length: ends.length / 6 }, (_, i) => i);
    this.show(ends, order, order.length, () => colour);
  }
}
