// Shaders of the twin. The cloth's radiance is |cos th_i| / (|cos th_i| + |cos th_o|) sum_k W_k(x) T_k(wo, wi): W in an array of textures of the tile,
// T in a second array, whose layers, rows and columns twin.json describes (optimizer/report/export/twin_result.h).
import { nearDetailText } from "./twin_near_shaders.js";

export const vertexText = `#version 300 es
in vec3 position;
in vec3 normal;
in vec3 weft;
in vec2 place;
uniform mat4 camera;
out vec3 at;
out vec3 up;
out vec3 along;
out vec2 cloth;
void main() {
  at = position;
  up = normal;
  along = weft;
  cloth = place;
  gl_Position = camera * vec4(position, 1.0);
}`;

export const depthVertexText = `#version 300 es
in vec3 position;
uniform mat4 camera;
void main() { gl_Position = camera * vec4(position, 1.0); }`;

export const depthFragmentText = `#version 300 es
precision mediump float;
void main() { }`;

// groups: textures in fours; lights: most lights beside the lamp.
export const fragmentText = (groups, lights) => `#version 300 es
precision highp float;
precision highp sampler2DArray;
const int GROUPS = ${groups}, LIGHTS = ${lights};
in vec3 at;
in vec3 up;
in vec3 along;
in vec2 cloth;
uniform sampler2DArray textures, table;
uniform sampler2D shadows;
uniform vec3 eye;
uniform vec2 tile;              // mm
uniform vec2 tableSize;         // columns and rows
uniform float viewEdge, lightEdge;
uniform int sides;
uniform vec3 lamp;              // mm
uniform float lampDistance;     // from the orbit center, where its irradiance is pi
uniform float lampSide;
uniform float lampPower;
uniform mat4 lampCamera;
uniform vec2 lampRange;         // near and far plane
uniform float lampPixel;        // width of the shadow map at the distance 1
uniform int lightCount;
uniform vec4 lightFrom[LIGHTS]; // direction, and radiance times solid angle over pi
uniform vec3 lightColor[LIGHTS];
uniform float exposure;
uniform bool curve;             // highlights keep their color
out vec4 color;

vec4 weight[GROUPS];

// The octahedral map of a hemisphere onto [0, 1]^2 (direction_grid.h).
vec2 square(vec3 d) {
  float sum = abs(d.x) + abs(d.y) + abs(d.z);
  return 0.5 + 0.5 * vec2(d.x + d.y, d.x - d.y) / sum;
}

vec3 look(vec2 view, vec2 light) {
  vec2 p = (view * vec2(float(sides), 1.0) * lightEdge + light) / tableSize;
  vec3 sum = vec3(0.0);
  for (int g = 0; g < GROUPS; g++)
    for (int c = 0; c < 3; c++) sum[c] += dot(weight[g], texture(table, vec3(p, float(3 * g + c))));
  return sum;
}

// Radiance towards wo under irradiance pi from wi, both in the frame weft, warp, normal.
vec3 radiance(vec3 wo, vec3 wi) {
  if (sides == 1 && (wo.z <= 0.0 || wi.z <= 0.0)) return vec3(0.0);
  vec2 light = clamp(square(wi) * lightEdge, 0.5, lightEdge - 0.5);
  if (wi.z < 0.0) light.x += lightEdge;
  vec2 view = clamp(square(wo) * viewEdge - 0.5, 0.0, viewEdge - 1.0), low = min(floor(view), viewEdge - 2.0), part = view - low;
  if (wo.z < 0.0) low.y += viewEdge;
  vec3 a = mix(look(low, light), look(low + vec2(1.0, 0.0), light), part.x);
  vec3 b = mix(look(low + vec2(0.0, 1.0), light), look(low + vec2(1.0, 1.0), light), part.x);
  return max(mix(a, b, part.y), 0.0) * abs(wi.z) / (abs(wi.z) + abs(wo.z));
}

float distanceOf(float depth) {
  return lampRange.x * lampRange.y / (lampRange.y - depth * (lampRange.y - lampRange.x));
}

const vec2 spot[12] = vec2[](vec2(-0.33, -0.41), vec2(-0.84, -0.07), vec2(-0.70, 0.46), vec2(-0.20, 0.62), vec2(0.96, -0.19), vec2(0.47, -0.48),
  vec2(0.52, 0.77), vec2(0.19, -0.89), vec2(0.51, 0.06), vec2(0.90, 0.41), vec2(-0.32, -0.93), vec2(-0.09, 0.13));

// Share of the lamp that is seen: percentage-closer soft shadows (Fernando 2005).
float seen(vec3 n, float cosine) {
  float slope = sqrt(1.0 - cosine * cosine) / max(cosine, 0.1); // how fast the cloth itself comes nearer to the lamp
  vec4 p = lampCamera * vec4(at + 0.15 * n, 1.0);
  vec3 q = p.xyz / p.w * 0.5 + 0.5;
  if (q.x <= 0.0 || q.y <= 0.0 || q.x >= 1.0 || q.y >= 1.0) return 1.0;
  float here = distanceOf(q.z), blocker = 0.0, n_blocker = 0.0, search = 2.0 / (lampPixel * here), open = 0.0;
  for (int i = 0; i < 12; i++) {
    float d = distanceOf(texture(shadows, q.xy + search * spot[i]).r);
    if (d < here - 0.3 - 2.0 * slope * length(spot[i])) { blocker += d; n_blocker += 1.0; }
  }
  if (n_blocker == 0.0) return 1.0;
  blocker /= n_blocker;
  float radius = clamp(0.5 * lampSide * (here - blocker) / blocker, 0.1, 4.0);
  for (int i = 0; i < 12; i++) {
    float d = distanceOf(texture(shadows, q.xy + radius / (lampPixel * here) * spot[i]).r);
    open += d < here - 0.3 - radius * slope * length(spot[i]) ? 0.0 : 1.0 / 12.0;
  }
  return open;
}

${nearDetailText}
// Khronos PBR Neutral, as renderer/image/tone_curve.h has it.
vec3 toned(vec3 c) {
  const float start = 0.76, room = 0.24;
  float least = min(c.r, min(c.g, c.b));
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(c.r, max(c.g, c.b)), lowered = 1.0 - room * room / (peak + room - start);
  if (peak < start) return c;
  return mix(c * lowered / peak, vec3(lowered), 1.0 - 1.0 / (0.15 * (peak - lowered) + 1.0));
}

float encoded(float x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }

void main() {
  vec3 n = normalize(up), t = normalize(along - dot(along, n) * n), b = cross(n, t);
  vec3 toEye = normalize(eye - at), toLamp = lamp - at;
  vec3 wo = vec3(dot(toEye, t), dot(toEye, b), dot(toEye, n));
  for (int g = 0; g < GROUPS; g++) weight[g] = texture(textures, vec3(cloth / tile, float(g)));
  vec3 sum = vec3(0.0), bare = vec3(0.0); // bare: without shadow
  if (lampPower > 0.0) {
    float far = length(toLamp);
    vec3 l = toLamp / far;
    float faces = max(dot(normalize(lamp), l), 0.0), falls = lampDistance / far;
    vec3 lit = radiance(wo, vec3(dot(l, t), dot(l, b), dot(l, n)));
    lit *= lampPower * faces * falls * falls;
    bare += lit;
    if (lit.r + lit.g + lit.b > 0.0) sum += seen(dot(l, n) > 0.0 ? n : -n, abs(dot(l, n))) * lit;
  }
  for (int i = 0; i < LIGHTS; i++) {
    if (i >= lightCount) break;
    vec3 l = lightFrom[i].xyz;
    vec3 lit = lightFrom[i].w * lightColor[i] * radiance(wo, vec3(dot(l, t), dot(l, b), dot(l, n)));
    sum += lit;
    bare += lit;
  }
  if (nearWeight > 0.0) sum *= fiberDetail(bare);
  sum *= exposure;
  if (curve) sum = toned(sum);
  color = vec4(encoded(sum.r), encoded(sum.g), encoded(sum.b), 1.0);
}`;
