// What both ways to draw the yard have in common; THREE is the module that each draws with.

/** The maps of a material as textures: `base`, `normal`, `specular`. */
export function textures(THREE, { side, base, normal, specular }) {
  const texture = (texels, space) => {
    const texture = new THREE.DataTexture(texels, side, side);
    texture.colorSpace = space;
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.magFilter = THREE.LinearFilter;
    texture.minFilter = THREE.LinearMipmapLinearFilter;
    texture.generateMipmaps = true;
    texture.needsUpdate = true;
    return texture;
  };
  return {
    base: texture(base, THREE.SRGBColorSpace),
    normal: texture(normal, THREE.NoColorSpace),
    specular: texture(specular, THREE.NoColorSpace),
  };
}

/** Objects that are drawn together: pairs of a group's number and its members. */
export function grouped(objects) {
  const groups = new Map();
  for (const object of objects) {
    if (!groups.has(object.group)) groups.set(object.group, []);
    groups.get(object.group).push(object);
  }
  return [...groups];
}
