// The files of a drop, and all files of dropped folders, whatever their depth; folder: the name of the only one, else empty.

const entriesOf = (reader) => new Promise((done, failed) => reader.readEntries(done, failed));
const fileOf = (entry) => new Promise((done, failed) => entry.file(done, failed));

async function collect(entry, files) {
  if (entry.isFile) {
    if (!entry.name.startsWith(".")) files.push(await fileOf(entry));
    return;
  }
  const reader = entry.createReader();
  for (let list = await entriesOf(reader); list.length > 0; list = await entriesOf(reader)) // a part of the folder at a time
    for (const one of list) await collect(one, files);
}

export async function droppedFiles(transfer) {
  // all entries at once, because they are gone when the event is over
  const entries = [...transfer.items ?? []].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return { files: [...transfer.files], folder: "" };
  const files = [];
  for (const entry of entries) await collect(entry, files);
  return { files, folder: entries.length === 1 && entries[0].isDirectory ? entries[0].name : "" };
}
