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

/** So many instances of a mesh, with identities for their matrices. */
export function instances(THREE, geometry, material, count) {
  const mesh = new THREE.InstancedMesh(geometry, material, count);
  mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
  const identity = new THREE.Matrix4();
  for (let i = 0; i < count; i++) mesh.setMatrixAt(i, identity);
  return mesh;
}

/** The adapter's name, and how to wait until it has drawn. */
export function reader(gl) {
  const texel = new Uint8Array(4);
  const named = gl.getExtension('WEBGL_debug_renderer_info');
  return {
    adapter: gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER),
    finish: () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, texel),
  };
}
