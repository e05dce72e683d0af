// Clips a material of three.js to an outline, in WebGPURenderer: the same as `clip-glsl.js`, as nodes, for WGSL and GLSL.
//
// The renderer takes materials with the same nodes for one, so that nodes must not hold what is a mesh's own: they ask the mesh that is
// drawn. They do so when all else is ready, for a shadow may be drawn while a mesh waits for its turn.
import { DataArrayTexture, DataTexture, FloatType, RGBAFormat, RGBAIntegerFormat, UnsignedIntType, Vector2, Vector4 } from 'three';
import {
  Fn, If, Loop, bool, cross, dFdx, dFdy, dot, float, instanceIndex, int, ivec2, materialOpacity, max, min, mix, normalize, positionGeometry, select,
  sqrt, texture, uint, uintBitsToFloat, uniform, varying, vec2, vec3, vec4,
} from 'three/tsl';
import { ROW } from './clip-glsl.js';

const flat = (node, name) => varying(node, name).setInterpolation('flat', 'either');

/** Something of the mesh that is drawn, by the name of its uniform. */
const ofMesh = (node, name) => node.onObjectUpdate(({ object, camera, renderer, renderId }) => {
  object.updateOnce(renderer, camera, renderId);
  return object.clipUniforms[name].value;
});

/** The eye of what is drawn, and the first texel and the points of its outline. */
function recordOf(isInstanced) {
  if (!isInstanced) {
    return [ofMesh(uniform(new Vector4()), 'silmapEye'), ivec2(ofMesh(uniform(new Vector2()), 'silmapOutline'))];
  }
  const records = ofMesh(texture(new DataTexture(new Float32Array(8), 2, 1, RGBAFormat, FloatType)), 'silmapRecords');
  const first = int(instanceIndex).mul(int(2));
  const at = (next) => records.load(ivec2(first.mod(int(ROW)).add(int(next)), first.div(int(ROW))));
  return [at(0), ivec2(at(1).xy)];
}

/** The picture of an eye in which the sphere fills the square from −1 to 1: rows whose products with a point are (x·w, y·w, w). */
const rowsOf = (eye, sphere, sortedRight) => {
  const isPlace = eye.w.greaterThan(0.5);
  const room = sphere.w.mul(1.02);
  const arm = sphere.xyz.sub(eye.xyz);
  const forward = select(isPlace, normalize(arm), eye.xyz.negate()).toVar();
  const outside = max(dot(arm, arm).sub(sphere.w.mul(sphere.w)), 0);
  const magnify = select(isPlace, sqrt(outside), float(1)).div(room).toVar();
  const right = normalize(sortedRight.sub(forward.mul(dot(sortedRight, forward)))).toVar();
  const up = cross(right, forward).toVar();
  return {
    x: vec4(right, dot(right, sphere.xyz).negate()).mul(magnify),
    y: vec4(up, dot(up, sphere.xyz).negate()).mul(magnify),
    w: select(isPlace, vec4(forward, dot(forward, eye.xyz).negate()), vec4(0, 0, 0, 1)),
  };
};

/** Edges that cross the half-line from the origin to the right wind about it. */
const turnOf = (a, b) => {
  const isUp = b.y.greaterThan(a.y);
  const isRight = a.x.mul(b.y).sub(a.y.mul(b.x)).greaterThan(0).equal(isUp);
  const isCrossing = a.y.lessThanEqual(0).notEqual(b.y.lessThanEqual(0));
  return select(isCrossing.and(isRight), select(isUp, int(1), int(-1)), int(0));
};

/** How much of the pixel is inside; 0 or 1 where no part counts. */
function shareNode(isInstanced) {
  const nothing = Object.assign(new DataArrayTexture(new Uint32Array(4), 1, 1, 1), { format: RGBAIntegerFormat, type: UnsignedIntType });
  const texels = ofMesh(texture(nothing), 'silmapTexels');
  // Both lengths are powers of two.
  const rowBits = ofMesh(uniform(0, 'uint'), 'silmapLayerBits');
  const lastRow = int(1).shiftLeft(rowBits).sub(int(1));
  const texel = (at) => {
    const row = at.shiftRight(uint(Math.log2(ROW)));
    return texels.load(ivec2(at.bitAnd(int(ROW - 1)), row.bitAnd(lastRow))).depth(row.shiftRight(rowBits));
  };
  const sphere = ofMesh(uniform(new Vector4()), 'silmapSphere');
  const fromMesh = ofMesh(uniform(new Vector4()), 'silmapFromMesh');
  const soft = ofMesh(uniform(0), 'silmapSoft');
  const [eye, outline] = recordOf(isInstanced);

  const rows = rowsOf(eye, sphere, uintBitsToFloat(texel(outline.x.add(2)).xyz));
  const point = vec4(positionGeometry.mul(fromMesh.w).add(fromMesh.xyz), 1);
  const seen = varying(vec3(dot(rows.x, point), dot(rows.y, point), dot(rows.w, point)), 'silmapSeen');
  const [rowX, rowY, rowW] = ['x', 'y', 'w'].map((row) => flat(rows[row], `silmapRow${row.toUpperCase()}`));
  const range = flat(outline, 'silmapRange');

  const halfOf = (first, index) => {
    const texelOf = texel(first.add(index.div(int(8)))).toVar();
    const word = texelOf.element(index.mod(int(8)).div(int(2)));
    return int(word.shiftRight(uint(index.mod(int(2))).mul(uint(16))).bitAnd(uint(0xffff)));
  };
  const seenAt = (index) => {
    const at = vec4(uintBitsToFloat(texel(range.x.add(3).add(index)).xyz), 1).toVar();
    return vec2(dot(rowX, at), dot(rowY, at)).div(dot(rowW, at));
  };

  return Fn(() => {
    const place = seen.xy.div(seen.z).toVar();
    // Before all branches: neighbours have to take part.
    const across = dFdx(place).toVar();
    const along = dFdy(place).toVar();
    const share = float(1).toVar();
    If(range.y.greaterThan(0), () => {
      share.assign(0);
      If(max(place.x.abs(), place.y.abs()).lessThan(1), () => {
        const head = texel(range.x).toVar();
        const begins = texel(range.x.add(1)).toVar();
        const unit = place.mul(0.5).add(0.5).toVar();
        const side = int(head.z).toVar();
        const at = min(ivec2(unit.mul(float(side))), ivec2(side.sub(1), side.sub(1))).toVar();
        const cell = at.y.mul(side).add(at.x).toVar();
        const cells = texel(range.x.add(int(begins.z)).add(cell.div(int(64)))).toVar();
        const word = cells.element(cell.mod(int(64)).div(int(16)));
        const state = word.shiftRight(uint(cell.mod(int(16))).mul(uint(2))).bitAnd(uint(3)).toVar();
        share.assign(float(state));
        If(state.equal(uint(2)), () => {
          const area = across.x.mul(along.y).sub(across.y.mul(along.x)).toVar();
          const pixelX = vec2(along.y, along.x.negate()).div(area).toVar();
          const pixelY = vec2(across.y.negate(), across.x).div(area).toVar();
          const bands = range.x.add(int(begins.x)).toVar();
          const edges = range.x.add(int(begins.y)).toVar();
          const band = min(int(unit.y.mul(float(head.y))), int(head.y).sub(1)).toVar();
          const first = halfOf(bands, band).toVar();
          const last = halfOf(bands, band.add(1)).toVar();
          const winding = int(0).toVar();
          const nearest = float(1e30).toVar();
          const before = int(-2).toVar();
          const b = vec2(0, 0).toVar();
          Loop({ start: first, end: last, type: 'int', condition: '<' }, ({ i }) => {
            const edge = halfOf(edges, i).toVar();
            // Most edges begin where the one before ends.
            const a = b.toVar();
            If(edge.notEqual(before.add(1)), () => {
              a.assign(seenAt(edge).sub(place));
            });
            b.assign(seenAt(edge.add(1)).sub(place));
            before.assign(edge);
            winding.addAssign(turnOf(a, b));
            const p = vec2(dot(a, pixelX), dot(a, pixelY)).toVar();
            const way = vec2(dot(b, pixelX), dot(b, pixelY)).sub(p).toVar();
            const onEdge = dot(p, way).negate().div(max(dot(way, way), 1e-12)).clamp(0, 1);
            const off = p.add(way.mul(onEdge)).toVar();
            nearest.assign(min(nearest, dot(off, off)));
          });
          const isInside = winding.notEqual(int(0));
          const reach = sqrt(nearest).mul(select(isInside, float(1), float(-1)));
          share.assign(mix(select(isInside, float(1), float(0)), reach.add(0.5).clamp(0, 1), soft));
        });
      });
    });
    return share;
  })();
}

const shares = new Map();

/** Makes a material of a mesh, or of an instanced one, draw inside of outlines alone. */
export function clipByNodes(material, isInstanced) {
  if (!shares.has(isInstanced)) shares.set(isInstanced, shareNode(isInstanced).toVar());
  const share = shares.get(isInstanced);
  const mask = bool(share.greaterThan(0));
  material.maskNode = material.maskNode ? mask.and(material.maskNode) : mask;
  material.opacityNode = (material.opacityNode ?? materialOpacity).mul(share);
  return material;
}
