// Clips a material of three.js to an outline, in WebGLRenderer: GLSL that finds how an outline covers a pixel.
//
// The layout of outlines is that of `silmap-curve` (curve.rs); the functions are those of `outline.wgsl` of `silmap-runtime`.

/** Texels of a row of the textures that hold outlines, and records of instances. */
export const ROW = 1024;

const READ = /* glsl */ `
uniform highp usampler2D silmapTexels;
uvec4 silmapTexel(int at) { return texelFetch(silmapTexels, ivec2(at & ${ROW - 1}, at / ${ROW}), 0); }
`;

const VERTEX_PARS = /* glsl */ `
${READ}
#ifdef USE_INSTANCING
uniform highp sampler2D silmapRecords;
#else
uniform highp vec4 silmapEye;
uniform highp vec2 silmapOutline;
#endif
// Middle and radius of the sphere about the model; what a vertex is moved by and scaled with, to the map's coordinates.
uniform highp vec4 silmapSphere;
uniform highp vec4 silmapFromMesh;
varying highp vec3 silmapSeen;
flat varying highp vec4 silmapRowX;
flat varying highp vec4 silmapRowY;
flat varying highp vec4 silmapRowW;
flat varying highp ivec2 silmapRange;
`;

// The picture of an eye in which the sphere fills the square from -1 to 1, and the vertex in it.
const VERTEX = /* glsl */ `
#ifdef USE_INSTANCING
ivec2 silmapAt = ivec2((2 * gl_InstanceID) & ${ROW - 1}, (2 * gl_InstanceID) / ${ROW});
vec4 silmapEye = texelFetch(silmapRecords, silmapAt, 0);
vec2 silmapOutline = texelFetch(silmapRecords, silmapAt + ivec2(1, 0), 0).xy;
#endif
silmapRange = ivec2(silmapOutline);
if (silmapRange.y > 0) {
  vec3 sortedRight = uintBitsToFloat(silmapTexel(silmapRange.x + 2).xyz);
  float room = 1.02 * silmapSphere.w;
  vec3 forward = -silmapEye.xyz;
  float magnify = 1.0 / room;
  silmapRowW = vec4(0.0, 0.0, 0.0, 1.0);
  if (silmapEye.w > 0.5) {
    vec3 arm = silmapSphere.xyz - silmapEye.xyz;
    float away = length(arm);
    forward = arm / away;
    magnify = sqrt(max(away * away - silmapSphere.w * silmapSphere.w, 0.0)) / room;
    silmapRowW = vec4(forward, -dot(forward, silmapEye.xyz));
  }
  vec3 right = normalize(sortedRight - forward * dot(sortedRight, forward));
  vec3 up = cross(right, forward);
  silmapRowX = vec4(right, -dot(right, silmapSphere.xyz)) * magnify;
  silmapRowY = vec4(up, -dot(up, silmapSphere.xyz)) * magnify;
} else {
  silmapRowX = silmapRowY = silmapRowW = vec4(0.0);
}
vec4 silmapPoint = vec4(position * silmapFromMesh.w + silmapFromMesh.xyz, 1.0);
silmapSeen = vec3(dot(silmapRowX, silmapPoint), dot(silmapRowY, silmapPoint), dot(silmapRowW, silmapPoint));
`;

const FRAGMENT_PARS = /* glsl */ `
${READ}
uniform float silmapSoft;
varying highp vec3 silmapSeen;
flat varying highp vec4 silmapRowX;
flat varying highp vec4 silmapRowY;
flat varying highp vec4 silmapRowW;
flat varying highp ivec2 silmapRange;

// 0 outside, 1 inside, 2 near the border.
uint silmapCell(vec2 place) {
  if (max(abs(place.x), abs(place.y)) >= 1.0) return 0u;
  int side = int(silmapTexel(silmapRange.x).z);
  ivec2 at = min(ivec2((place * 0.5 + 0.5) * float(side)), ivec2(side - 1));
  uint cell = uint(at.y * side + at.x);
  uvec4 cells = silmapTexel(silmapRange.x + int(silmapTexel(silmapRange.x + 1).z + cell / 64u));
  return (cells[(cell % 64u) / 16u] >> (2u * (cell % 16u))) & 3u;
}

int silmapHalf(int first, int index) {
  uvec4 texel = silmapTexel(first + index / 8);
  return int((texel[(index % 8) / 2] >> (16u * uint(index % 2))) & 0xffffu);
}

highp vec2 silmapSeenAt(int index) {
  highp vec4 point = vec4(uintBitsToFloat(silmapTexel(silmapRange.x + 3 + index).xyz), 1.0);
  return vec2(dot(silmapRowX, point), dot(silmapRowY, point)) / dot(silmapRowW, point);
}

// Edges that cross the half-line from the origin to the right wind about it.
int silmapTurn(highp vec2 a, highp vec2 b) {
  if ((a.y <= 0.0) == (b.y <= 0.0)) return 0;
  bool isUp = b.y > a.y;
  bool isRight = (a.x * b.y - a.y * b.x > 0.0) == isUp;
  return isRight ? (isUp ? 1 : -1) : 0;
}

// How much of the pixel is inside; 0 or 1 where no part counts.
float silmapShare() {
  if (silmapRange.y <= 0) return 1.0;
  highp vec2 place = silmapSeen.xy / silmapSeen.z;
  highp vec2 across = dFdx(place);
  highp vec2 along = dFdy(place);
  uint state = silmapCell(place);
  if (state != 2u) return float(state);
  float area = across.x * along.y - across.y * along.x;
  vec2 pixelX = vec2(along.y, -along.x) / area;
  vec2 pixelY = vec2(-across.y, across.x) / area;
  uvec4 head = silmapTexel(silmapRange.x);
  ivec3 begins = ivec3(silmapTexel(silmapRange.x + 1).xyz) + silmapRange.x;
  int band = min(int((place.y * 0.5 + 0.5) * float(head.y)), int(head.y) - 1);
  int last = silmapHalf(begins.x, band + 1);
  int winding = 0;
  float nearest = 1e30;
  int before = -2;
  highp vec2 b = vec2(0.0);
  for (int k = silmapHalf(begins.x, band); k < last; k++) {
    int edge = silmapHalf(begins.y, k);
    // Most edges begin where the one before ends.
    highp vec2 a = edge == before + 1 ? b : silmapSeenAt(edge) - place;
    b = silmapSeenAt(edge + 1) - place;
    before = edge;
    winding += silmapTurn(a, b);
    if (silmapSoft > 0.5) {
      vec2 p = vec2(dot(a, pixelX), dot(a, pixelY));
      vec2 way = vec2(dot(b, pixelX), dot(b, pixelY)) - p;
      vec2 off = p + way * clamp(-dot(p, way) / max(dot(way, way), 1e-12), 0.0, 1.0);
      nearest = min(nearest, dot(off, off));
    }
  }
  if (silmapSoft < 0.5) return winding != 0 ? 1.0 : 0.0;
  float reach = sqrt(nearest);
  return clamp(winding != 0 ? 0.5 + reach : 0.5 - reach, 0.0, 1.0);
}
`;

const insert = (shader, place, code) => {
  if (!shader.includes(place)) throw new Error(`the material's shader has no ${place}`);
  return shader.replace(place, code);
};

/**
 * Makes a material draw inside of an outline alone. `uniforms` are those of one mesh, which it keeps up to date. A partly covered pixel
 * has its share in alpha where `silmapSoft` says so, for alpha to coverage.
 */
export function clipByGlsl(material, uniforms) {
  const { onBeforeCompile, customProgramCacheKey } = material;
  material.onBeforeCompile = (shader, renderer) => {
    onBeforeCompile.call(material, shader, renderer);
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = insert(shader.vertexShader, 'void main() {', `${VERTEX_PARS}\nvoid main() {\n${VERTEX}`);
    const begun = insert(shader.fragmentShader, 'void main() {', `${FRAGMENT_PARS}\nvoid main() {\nfloat silmapCovered = silmapShare();`);
    // After textures were read, which needs neighbouring pixels.
    shader.fragmentShader = insert(begun, '#include <alphatest_fragment>',
      '#include <alphatest_fragment>\nif (silmapCovered <= 0.0) discard;\nif (silmapSoft > 0.5) diffuseColor.a *= silmapCovered;');
  };
  material.customProgramCacheKey = () => `silmap ${customProgramCacheKey.call(material)}`;
  return material;
}
