// three.js's own material and lights: Blinn-Phong with normal and specular map, clustered lighting.
import * as THREE from 'three/webgpu';
import { ClusteredLighting } from 'three/addons/lighting/ClusteredLighting.js';
import { grouped, instances, reader, textures } from './common.js';

export async function start({ plan, size, materials, objects, lights, maps, pose, view }) {
  const canvas = document.createElement('canvas');
  const renderer = new THREE.WebGPURenderer({ canvas, antialias: false, forceWebGL: true });
  renderer.lighting = new ClusteredLighting(Math.max(lights.length, 1), 32, 24, plan.room);
  renderer.setSize(plan.width, plan.height, false);
  renderer.setClearColor(0x101820);
  await renderer.init();
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(60, plan.width / plan.height, 0.1, 5000);
  camera.position.set(...view.eye);
  camera.lookAt(...view.target);
  camera.updateMatrixWorld();
  scene.add(new THREE.AmbientLight(0xffffff, 0.12 * Math.PI));
  for (const { position, color } of lights) {
    // Lambert's term of three.js divides by π.
    const light = new THREE.PointLight(new THREE.Color(...color), Math.PI, 10, 2);
    light.position.set(...position);
    scene.add(light);
  }
  const surfaces = Array.from({ length: materials }, (_, i) => {
    const { base, normal, specular } = textures(THREE, maps(i));
    return new THREE.MeshPhongNodeMaterial({
      map: base,
      normalMap: normal,
      specularMap: specular,
      specular: 0xffffff,
      shininess: 32,
    });
  });
  const cube = new THREE.BoxGeometry(size, size, size);
  const meshes = grouped(objects).map(([group, members]) => {
    const mesh = instances(THREE, cube, surfaces[group % materials], members.length);
    scene.add(mesh);
    return { mesh, members };
  });
  scene.updateMatrixWorld();
  scene.matrixWorldAutoUpdate = false;
  const move = (seconds) => {
    for (const { mesh, members } of meshes) {
      const matrices = mesh.instanceMatrix.array;
      members.forEach((object, i) => pose(object, seconds, matrices, i * 16));
      mesh.instanceMatrix.needsUpdate = true;
    }
  };
  move(0);
  for (const { mesh } of meshes) {
    mesh.computeBoundingSphere();
    mesh.boundingSphere.radius += 1;
  }
  await renderer.compileAsync(scene, camera);
  return {
    canvas,
    revision: THREE.REVISION,
    ...reader(renderer.backend.gl),
    move,
    draw: () => renderer.render(scene, camera),
    draws: () => renderer.info.render.drawCalls,
  };
}
