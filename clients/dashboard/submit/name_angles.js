// Angles of lamp, camera and cloth in the names of photographs, such as t45_p180.dng: the rules and the usual patterns of
// `selvedge init` (clients/cli/text/name_angles.c).

// Keys of a photograph in the job document, and their places in a pattern.
export const ANGLES = [["light_theta_deg", "{light_theta}"], ["light_phi_deg", "{light_phi}"], ["camera_theta_deg", "{camera_theta}"],
  ["camera_phi_deg", "{camera_phi}"], ["cloth_rotation_deg", "{rotation}"]];

// The rotation first, so that it is not left to a '*'.
export const USUAL = [
  "lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}_r{rotation}",
  "lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}",
  "light{light_theta}_{light_phi}_camera{camera_theta}_{camera_phi}_rotation{rotation}",
  "light{light_theta}_{light_phi}_camera{camera_theta}_{camera_phi}",
  "l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}_r{rotation}",
  "l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}",
  "t{light_theta}_p{light_phi}_r{rotation}",
  "t{light_theta}_p{light_phi}",
  "theta{light_theta}_phi{light_phi}",
  "{light_theta}_{light_phi}_{camera_theta}_{camera_phi}_{rotation}",
  "{light_theta}_{light_phi}_{camera_theta}_{camera_phi}",
  "*_lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}*",
  "*_l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}*",
  "*_t{light_theta}_p{light_phi}_r{rotation}",
  "*_t{light_theta}_p{light_phi}",
  "t{light_theta}_p{light_phi}_*",
];

export const stemOf = (name) => (name.lastIndexOf(".") > 0 ? name.slice(0, name.lastIndexOf(".")) : name);

// The pattern as a regular expression, and the keys of its groups. A number is taken whole (the look-ahead), as the shell does.
function compiled(pattern) {
  const keys = [];
  const text = pattern.split(/(\{[^}]*\}?|\*|_)/).map((part) => {
    if (part === "*") return "[^]*?";
    if (part === "_") return "[-_. ]";
    const angle = ANGLES.find(([, place]) => place === part);
    if (!angle) return part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    keys.push(angle[0]);
    return `(?=([+-]?\\d+(?:\\.\\d+)?))\\${keys.length}`;
  }).join("");
  return { expression: new RegExp(`^${text}$`, "i"), keys };
}

// A sentence on an unknown or a second place of an angle, or a pattern without any; null: the pattern is right.
export function patternFault(pattern) {
  const places = pattern.match(/\{[^}]*\}?/g) ?? [], unknown = places.find((p) => !ANGLES.some(([, place]) => place === p));
  if (unknown) return `The pattern has an unknown place '${unknown}': known are ${ANGLES.map(([, place]) => place).join(", ")}.`;
  const twice = places.find((p, i) => places.indexOf(p) !== i);
  if (twice) return `The pattern has ${twice} twice.`;
  return places.length ? null : "The pattern has no place of an angle, such as {light_theta}.";
}

// The angles in a name without its ending, by their keys; null when the whole name does not fit.
export function anglesOf(pattern, stem) {
  const { expression, keys } = compiled(pattern), found = expression.exec(stem);
  return found ? Object.fromEntries(keys.map((key, i) => [key, Number(found[i + 1])])) : null;
}

// The first of the usual patterns that all names fit; null: none.
export const guessPattern = (stems) => (stems.length ? USUAL.find((pattern) => stems.every((stem) => anglesOf(pattern, stem))) ?? null : null);
