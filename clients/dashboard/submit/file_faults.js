// Faults that the files of a new job show together: exposures that only some photographs state, and names that two files have.
import { hasReadTags, exposureOf } from "./thumbnails.js";

const some = (names) => `${names.slice(0, 3).join(", ")}${names.length > 3 ? ` and ${names.length - 3} more` : ""}`;

// A sentence when some photographs state an exposure and others do not; null otherwise, or while the tags are being read.
export function exposureFault(photographs) {
  if (photographs.length === 0 || !photographs.every(hasReadTags)) return null;
  const without = photographs.filter((file) => !(exposureOf(file).exposure_s > 0)).map((file) => file.name);
  if (without.length === 0 || without.length === photographs.length) return null;
  return `${without.length} of ${photographs.length} photographs do not state their exposure (${some(without)}): all must, or none. Give theirs as exposure_s in the form below, or leave them out.`;
}

// A sentence on names that occur more than once in a folder with its subfolders; null: there is none.
export function nameFault(files) {
  const names = files.map((file) => file.name), twice = [...new Set(names.filter((name, i) => names.indexOf(name) !== i))];
  return twice.length ? `Several files have the name ${some(twice)}: a job takes one of each name, here the last one. Rename the others to send them, too.` : null;
}
