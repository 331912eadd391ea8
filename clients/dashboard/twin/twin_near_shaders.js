// Shaders of the close view: the tile's fibers as ribbons that face the eye, laid on the shape as the cloth is, in every copy of the tile that
// is in view. A pixel gets the light that its fiber scatters once (rgb), and the share of the sky that the fiber sees (a).

export const nearVertexText = (lights) => `#version 300 es
precision highp float;
precision highp usampler2D;
const int LIGHTS = ${lights};
in vec2 copy;                    // of the tile
uniform usampler2D points;       // two texels a point (optimizer/report/export/twin_result.h)
uniform sampler2D places, normals, wefts; // of the shape, at the points of its grid
uniform mat4 camera;
uniform vec3 eye;
uniform vec3 low, span;          // bounds of the points, mm
uniform float radius;            // the largest
uniform vec2 tile, shapeFrom, shapeTo;
uniform highp int lightCount;
uniform vec3 lightFrom[LIGHTS];
out vec3 place, tangent;
out float open[LIGHTS], sky;     // shares of each light, and of the sky, that the fiber sees
flat out float material;

struct Point { vec3 at; float radius; float set; bool last; uvec4 open; };

Point pointAt(int i) {
  int width = textureSize(points, 0).x;
  uvec4 a = texelFetch(points, ivec2(2 * i % width, 2 * i / width), 0), b = texelFetch(points, ivec2((2 * i + 1) % width, (2 * i + 1) / width), 0);
  vec4 share = vec4(a.x & 65535u, a.x >> 16, a.y & 65535u, a.y >> 16) / 65535.0;
  return Point(low + span * share.xyz, radius * share.w, float(a.z & 255u), (a.z >> 31) == 1u, b);
}

// The place of the shape under a place of the cloth, between the points of its grid.
vec3 placeOf(vec2 share) {
  ivec2 most = textureSize(places, 0) - 2;
  vec2 at = share * vec2(most + 1);
  ivec2 corner = clamp(ivec2(floor(at)), ivec2(0), most);
  vec2 part = at - vec2(corner);
  vec3 a = mix(texelFetch(places, corner, 0).xyz, texelFetch(places, corner + ivec2(1, 0), 0).xyz, part.x);
  vec3 b = mix(texelFetch(places, corner + ivec2(0, 1), 0).xyz, texelFetch(places, corner + ivec2(1, 1), 0).xyz, part.x);
  return mix(a, b, part.y);
}

float cellOpen(uvec2 bits, ivec2 cell) {
  uint k = uint(8 * cell.y + cell.x);
  return float(((k < 32u ? bits.x : bits.y) >> (k & 31u)) & 1u);
}

// Share of a light that the point sees, in the frame of the cloth; the grid of directions is in direction_grid.h.
float seen(uvec4 open, vec3 d) {
  uvec2 bits = d.z >= 0.0 ? open.xy : open.zw;
  vec2 at = clamp((0.5 + 0.5 * vec2(d.x + d.y, d.x - d.y) / (abs(d.x) + abs(d.y) + abs(d.z))) * 8.0 - 0.5, 0.0, 7.0);
  ivec2 c = ivec2(min(floor(at), 6.0));
  vec2 part = at - vec2(c);
  return mix(mix(cellOpen(bits, c), cellOpen(bits, c + ivec2(1, 0)), part.x),
    mix(cellOpen(bits, c + ivec2(0, 1)), cellOpen(bits, c + ivec2(1, 1)), part.x), part.y);
}

float countBits(uint x) {
  x = x - ((x >> 1) & 0x55555555u);
  x = (x & 0x33333333u) + ((x >> 2) & 0x33333333u);
  x = (x + (x >> 4)) & 0x0f0f0f0fu;
  return float((x * 0x01010101u) >> 24);
}

void main() {
  int first = gl_VertexID / 4, end = gl_VertexID % 4 / 2;
  Point a = pointAt(first);
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (a.last) return;
  Point b = pointAt(first + 1), p = a;
  if (end == 1) p = b;
  vec3 along = b.at - a.at; // at a joint the mean of both segments
  if (end == 0 && first > 0) {
    Point before = pointAt(first - 1);
    if (!before.last) along = normalize(along) + normalize(a.at - before.at);
  }
  if (end == 1 && !b.last) along = normalize(along) + normalize(pointAt(first + 2).at - b.at);
  vec2 share = (p.at.xy + copy * tile - shapeFrom) / (shapeTo - shapeFrom), edge = vec2(textureSize(places, 0));
  vec2 texel = (clamp(share, 0.0, 1.0) * (edge - 1.0) + 0.5) / edge;
  vec3 n = normalize(textureLod(normals, texel, 0.0).xyz), w = textureLod(wefts, texel, 0.0).xyz;
  vec3 t = normalize(w - dot(w, n) * n), c = cross(n, t);
  place = placeOf(share) + p.at.z * n;
  tangent = normalize(mat3(t, c, n) * along);
  material = p.set;
  for (int i = 0; i < LIGHTS; i++) {
    vec3 l = lightFrom[i];
    open[i] = i < lightCount ? seen(p.open, vec3(dot(l, t), dot(l, c), dot(l, n))) : 0.0;
  }
  sky = (countBits(p.open.x) + countBits(p.open.y) + countBits(p.open.z) + countBits(p.open.w)) / 64.0;
  vec3 across = cross(tangent, normalize(eye - place));
  across = length(across) > 0.02 ? normalize(across) : c;
  gl_Position = camera * vec4(place + (gl_VertexID % 2 == 0 ? p.radius : -p.radius) * across, 1.0);
}`;

export const nearFragmentText = (lights) => `#version 300 es
precision highp float;
precision highp sampler3D;
const int LIGHTS = ${lights};
const float PI = 3.14159265;
in vec3 place, tangent;
in float open[LIGHTS], sky;
flat in float material;
uniform sampler3D lobes;
uniform float sets;
uniform vec3 eye;
uniform highp int lightCount;
uniform vec3 lightFrom[LIGHTS];
uniform vec3 lightColor[LIGHTS]; // irradiance over pi
out vec4 color;

// S cos th_i of the lobe table (renderer/preview/near_fibers.h).
vec3 scattered(vec3 l, vec3 o, vec3 t, float set) {
  float sinI = clamp(dot(l, t), -1.0, 1.0), sinO = clamp(dot(o, t), -1.0, 1.0);
  float thetaI = asin(sinI), thetaO = asin(sinO), middle = 0.5 * (thetaI + thetaO);
  float cosine = dot(l - sinI * t, o - sinO * t) / max(cos(thetaI) * cos(thetaO), 1e-4);
  float around = clamp(acos(clamp(cosine, -1.0, 1.0)) / PI, 0.5 / 16.0, 15.5 / 16.0);
  vec3 at = vec3(0.5 + 0.5 * sign(middle) * sqrt(abs(middle) * 2.0 / PI), 0.5 + 0.5 * (thetaO - thetaI) / PI, (set + around) / sets);
  return texture(lobes, at).rgb * cos(thetaI);
}

void main() {
  vec3 t = normalize(tangent), toEye = normalize(eye - place);
  color = vec4(0.0, 0.0, 0.0, 0.4 + sky);
  for (int i = 0; i < LIGHTS; i++)
    if (i < lightCount && open[i] > 0.0) color.rgb += PI * open[i] * lightColor[i] * scattered(lightFrom[i], toEye, t, material);
}`;

// For the shader of the cloth: how the fibers change its light where they are drawn. Their mean over a texel of the tables stays the light of the
// tables, so nothing jumps when they fade in: light that is scattered once comes from the fiber, the rest is spread by the sky that it sees.
export const nearDetailText = `
uniform sampler2D fibers;
uniform float nearWeight, nearLevel;

// Mean around a place over about a texel of the tables: a cubic B-spline of a level of the mipmap, from four bilinear samples.
vec4 fiberMean(vec2 place) {
  vec2 size = vec2(textureSize(fibers, int(nearLevel))), at = place * size - 0.5, part = fract(at), corner = at - part;
  vec2 p2 = part * part, p3 = p2 * part, w0 = (1.0 - 3.0 * part + 3.0 * p2 - p3) / 6.0, w1 = (4.0 - 6.0 * p2 + 3.0 * p3) / 6.0, w3 = p3 / 6.0;
  vec2 g0 = w0 + w1, g1 = 1.0 - g0, h0 = (corner - 0.5 + w1 / g0) / size, h1 = (corner + 1.5 + w3 / g1) / size;
  return g0.y * (g0.x * textureLod(fibers, h0, nearLevel) + g1.x * textureLod(fibers, vec2(h1.x, h0.y), nearLevel)) +
    g1.y * (g0.x * textureLod(fibers, vec2(h0.x, h1.y), nearLevel) + g1.x * textureLod(fibers, h1, nearLevel));
}

// Factor on the light that the tables have here without shadow.
vec3 fiberDetail(vec3 lit) {
  vec4 here = texelFetch(fibers, ivec2(gl_FragCoord.xy), 0), mean = fiberMean(gl_FragCoord.xy / vec2(textureSize(fibers, 0)));
  vec3 table = max(lit, 1e-6), share = min(vec3(1.0), 0.6 * table / max(mean.rgb, 1e-6));
  vec3 fiber = share * here.rgb + (table - share * mean.rgb) * here.a / max(mean.a, 1e-3);
  return mix(vec3(1.0), fiber / table, nearWeight);
}
`;
