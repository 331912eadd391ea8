// The files that a job document names, with the roles under which they are sent.
export function filesOf(doc) {
  const list = [], names = new Set();
  const add = (name, role) => { if (typeof name === "string" && !names.has(name)) { names.add(name); list.push({ name, role }); } };
  for (const name of doc.volume?.files ?? []) add(name, "volume");
  add(doc.fibers?.file, "fibers");
  add(doc.cloth?.draft_file, "draft");
  add(doc.cloth?.texture, "photograph");
  add(doc.environment?.file, "environment");
  add(doc.measurements?.file, "measurements");
  add(doc.rig?.file, "rig");
  add(doc.profile?.file, "profile");
  add(doc.camera?.noise_file, "camera_noise");
  for (const name of doc.camera?.dark_frames ?? []) add(name, "dark_frame");
  add(doc.color?.chart?.file, "chart");
  add(doc.color?.chart?.reference, "measurements");
  add(doc.color?.white?.file, "white_reference");
  for (const p of doc.photographs ?? []) for (const q of [p, ...(p?.more_exposures ?? [])]) add(q?.file, "photograph");
  add(doc.profile?.bowl?.mask, "photograph");
  for (const p of doc.profile?.bowl?.photographs ?? []) {
    for (const q of [p, ...(p?.more_exposures ?? [])]) add(q?.file, "photograph");
    add(p?.background, "photograph");
  }
  for (const p of doc.pictures ?? []) add(p?.mesh_file, "mesh");
  return list;
}
