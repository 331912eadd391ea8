/* Prints what Khronos' glTF validator finds in files: node validate_gltf.cjs PACKAGES FILE... PACKAGES: a folder with the npm package
 * gltf-validator. */
const fs = require("fs"), path = require("path");
const [packages, ...files] = process.argv.slice(2), validator = require(path.resolve(packages, "node_modules", "gltf-validator"));
(async () => {
  const found = [];
  for (const file of files) found.push((await validator.validateBytes(new Uint8Array(fs.readFileSync(file)))).issues);
  console.log(JSON.stringify(found));
})();
