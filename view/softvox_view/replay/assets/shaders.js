/** The shaders of the scene, in pairs: vertex shader and fragment shader. */

export const FLOOR = [
  `out vec2 spot;
void main() {
  spot = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(spot, 0.0, 1.0);
}`,
  `in vec2 spot;
uniform vec3 anchor, eye, forward, right, up; // eye relative to the anchor
uniform vec2 target; // relative to the anchor
uniform float fade, grid_line, grid_strength, axis_line, axis_strength;
uniform vec3 background, floor_colour, ink, x_axis, y_axis;
out vec4 colour;
vec2 covered(vec2 t) { // the part of a line from 0 to t that grid lines at the integers cover
  vec2 cell = floor(t);
  return cell * 2.0 * grid_line + min(t - cell, vec2(2.0 * grid_line));
}
vec2 lines(vec2 s, vec2 size) {
  vec2 low = s - size / 2.0 + grid_line;
  return (covered(low + size) - covered(low)) / size;
}
float half_axis(float along, float across, float size) {
  float coverage = min((axis_line + size / 2.0 - abs(across)) / size, 2.0 * axis_line / size);
  return clamp(coverage, 0.0, 1.0) * step(0.0, along) * axis_strength;
}
void main() {
  vec3 ray = forward + right * spot.x + up * spot.y;
  // At and above the horizon any large depth will do: the floor has faded there.
  vec2 point = eye.xy + ray.xy * eye.z / max(-ray.z, 0.01);
  vec2 size = max(fwidth(point), 1e-6);
  vec2 off = (point - target) / fade;
  float near = exp(-dot(off, off));
  vec2 grid = lines(point, size);
  vec2 place = point + anchor.xy;
  vec3 mixed = mix(background, floor_colour, near);
  mixed = mix(mixed, ink, max(grid.x, grid.y) * grid_strength * near);
  mixed = mix(mixed, x_axis, half_axis(place.x, place.y, size.y) * near);
  mixed = mix(mixed, y_axis, half_axis(place.y, place.x, size.x) * near);
  colour = vec4(mixed, 1.0);
}`,
];

const CORNER = `
uniform mat4 matrix; // from (x, y, z, 1) relative to the anchor to the clip space
layout(location = 0) in vec3 corner_0; // of a face, around outside, relative to the anchor
layout(location = 1) in vec3 corner_1;
layout(location = 2) in vec3 corner_2;
layout(location = 3) in vec3 corner_3;
layout(location = 4) in float active_voxel;
const vec2 CORNERS[4] = vec2[4](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1));
const int TRIANGLES[6] = int[6](0, 1, 2, 0, 2, 3);
// The place of the corner that a vertex (0 ... 5) stands for.
vec3 corner(out vec2 on_face, out vec3 normal) {
  vec3 corners[4] = vec3[4](corner_0, corner_1, corner_2, corner_3);
  int k = TRIANGLES[gl_VertexID];
  on_face = CORNERS[k];
  normal = normalize(cross(corner_2 - corner_0, corner_3 - corner_1));
  return corners[k];
}
`;

export const CUBES = [
  `${CORNER}
out vec2 on_face;
out vec3 base;
out float height;
uniform vec3 light, passive, active_colour;
uniform float darkest;
void main() {
  vec3 normal;
  vec3 world = corner(on_face, normal);
  height = world.z;
  // Half-Lambert shading: faces turned from the light still differ from each other.
  float lit = (1.0 + dot(normal, light)) / 2.0;
  base = mix(passive, active_colour, active_voxel) * mix(darkest, 1.0, lit);
  gl_Position = matrix * vec4(world, 1.0);
}`,
  `in vec2 on_face;
in vec3 base;
in float height;
uniform vec3 ink;
uniform float line; // half width of the edges, pixels
uniform float opacity;
out vec4 colour;
void main() {
  if (height < 0.0) discard; // the floor hides what has sunk into it
  vec2 gradient = vec2(length(vec2(dFdx(on_face.x), dFdy(on_face.x))),
                       length(vec2(dFdx(on_face.y), dFdy(on_face.y))));
  vec2 margin = (1.0 - abs(on_face)) / max(gradient, 1e-6);
  float drawn = clamp(line + 0.5 - min(margin.x, margin.y), 0.0, 1.0);
  colour = vec4(mix(base, ink, drawn), opacity);
}`,
];

export const SHADOW = [
  `${CORNER}
uniform vec3 light;
uniform vec2 shift;
void main() {
  vec2 on_face; vec3 normal;
  vec3 world = corner(on_face, normal);
  vec2 fallen = world.xy - light.xy / light.z * max(world.z, 0.0) + shift;
  gl_Position = matrix * vec4(fallen, 0.0, 1.0);
}`,
  `uniform float darkening;
out vec4 colour;
void main() { colour = vec4(vec3(1.0 - darkening), 1.0); }`,
];

export const STROKE = [
  `layout(location = 0) in vec2 from;
layout(location = 1) in vec2 to;
uniform mat4 matrix;
uniform vec3 anchor;
uniform vec2 pixels; // of the panel
uniform float stroke_width;
void main() {
  vec4 a = matrix * vec4(vec3(from, 0.0) - anchor, 1.0);
  vec4 b = matrix * vec4(vec3(to, 0.0) - anchor, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * pixels;
  along = length(along) < 1e-4 ? vec2(1.0, 0.0) : normalize(along);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 end = corner.x < 0.0 ? a : b;
  vec2 reach = along * corner.x * 0.5 + vec2(-along.y, along.x) * corner.y;
  gl_Position = end + vec4(reach * stroke_width / pixels * end.w, 0.0, 0.0);
}`,
  `uniform vec3 stroke;
out vec4 colour;
void main() { colour = vec4(stroke, 1.0); }`,
];
