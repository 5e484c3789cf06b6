// Each object lit by the three lights that are nearest to it: a shader of our own, and two attributes per instance.
import * as THREE from 'three';
import { grouped, instances, reader, textures } from './common.js';

const RANGE = 10;

const vertexShader = `
attribute vec4 tangent;
attribute vec3 chosen;
varying vec3 world, normal_, tangent_, bitangent;
varying vec2 st;
flat varying vec3 lights;
void main() {
  vec4 place = modelMatrix * instanceMatrix * vec4(position, 1.0);
  mat3 turned = mat3(modelMatrix) * mat3(instanceMatrix);
  world = place.xyz;
  normal_ = turned * normal;
  tangent_ = turned * tangent.xyz;
  bitangent = cross(normal_, tangent_) * tangent.w;
  st = uv;
  lights = chosen;
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const fragmentShader = `
uniform sampler2D baseMap, normalMap, specularMap, lightTable;
varying vec3 world, normal_, tangent_, bitangent;
varying vec2 st;
flat varying vec3 lights;
void main() {
  vec3 base = texture2D(baseMap, st).rgb;
  vec3 bump = texture2D(normalMap, st).xyz * 2.0 - 1.0;
  float specular = texture2D(specularMap, st).r;
  vec3 n = normalize(bump.x * tangent_ + bump.y * bitangent + bump.z * normal_);
  vec3 v = normalize(cameraPosition - world);
  vec3 color = base * 0.12;
  for (int i = 0; i < 3; i++) {
    int slot = int(lights[i]);
    if (slot < 0) break;
    vec3 l = texelFetch(lightTable, ivec2(0, slot), 0).xyz - world;
    float squared = dot(l, l);
    float x = squared / ${(RANGE * RANGE).toFixed(1)};
    float window = max(1.0 - x * x, 0.0);
    l *= inversesqrt(squared);
    float lambert = max(dot(n, l), 0.0);
    float shine = lambert > 0.0 ? pow(max(dot(n, normalize(l + v)), 0.0), 32.0) : 0.0;
    vec3 light = texelFetch(lightTable, ivec2(1, slot), 0).rgb * (window * window / max(squared, 0.01));
    color += light * (base * lambert + vec3(specular * shine));
  }
  gl_FragColor = vec4(color, 1.0);
  #include <colorspace_fragment>
}`;

/** Finds the lights nearest to a place, among those in the cells of a grid within their range. */
class Cells {
  constructor(lights) {
    this.places = Float32Array.from(lights.flatMap(({ position }) => position));
    const reach = Math.max(0, ...lights.map(({ position }) => Math.max(Math.abs(position[0]), Math.abs(position[2]))));
    this.half = Math.ceil(reach / RANGE) + 1;
    this.side = 2 * this.half;
    this.cells = Array.from({ length: this.side * this.side }, () => []);
    lights.forEach(({ position }, slot) => this.cells[this.index(position[0]) + this.side * this.index(position[2])].push(slot));
  }

  /** The row or column of a coordinate, of the outermost for what lies beyond. */
  index(v) {
    return Math.min(Math.max(Math.floor(v / RANGE) + this.half, 0), this.side - 1);
  }

  /** Writes three slots, the nearest first; −1 for none. */
  choose(x, y, z, reach, out, at) {
    let [a, b, c] = [-1, -1, -1];
    let nearestA = reach * reach;
    let [nearestB, nearestC] = [nearestA, nearestA];
    const [left, right] = [this.index(x - reach), this.index(x + reach)];
    for (let row = this.index(z - reach), last = this.index(z + reach); row <= last; row++) {
      for (let column = left; column <= right; column++) {
        const cell = this.cells[row * this.side + column];
        for (let i = 0; i < cell.length; i++) {
          const slot = cell[i];
          const dx = this.places[slot * 3] - x;
          const dy = this.places[slot * 3 + 1] - y;
          const dz = this.places[slot * 3 + 2] - z;
          const squared = dx * dx + dy * dy + dz * dz;
          if (squared < nearestA) {
            [c, nearestC, b, nearestB, a, nearestA] = [b, nearestB, a, nearestA, slot, squared];
          } else if (squared < nearestB) {
            [c, nearestC, b, nearestB] = [b, nearestB, slot, squared];
          } else if (squared < nearestC) {
            [c, nearestC] = [slot, squared];
          }
        }
      }
    }
    out[at] = a;
    out[at + 1] = b;
    out[at + 2] = c;
  }
}

export async function start({ plan, size, materials, objects, lights, maps, pose, view }) {
  const canvas = document.createElement('canvas');
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
  renderer.setSize(plan.width, plan.height, false);
  renderer.setClearColor(0x101820);
  const scene = new THREE.Scene();
  scene.matrixWorldAutoUpdate = false;
  const camera = new THREE.PerspectiveCamera(60, plan.width / plan.height, 0.1, 5000);
  camera.position.set(...view.eye);
  camera.lookAt(...view.target);
  camera.updateMatrixWorld();

  const table = new Float32Array(Math.max(lights.length, 1) * 8);
  lights.forEach(({ position, color }, slot) => table.set([...position, 0, ...color, 0], slot * 8));
  const lightTable = new THREE.DataTexture(table, 2, Math.max(lights.length, 1), THREE.RGBAFormat, THREE.FloatType);
  lightTable.needsUpdate = true;

  const surfaces = Array.from({ length: materials }, (_, i) => {
    const { base, normal, specular } = textures(THREE, maps(i));
    const uniforms = {
      baseMap: { value: base },
      normalMap: { value: normal },
      specularMap: { value: specular },
      lightTable: { value: lightTable },
    };
    return new THREE.ShaderMaterial({ uniforms, vertexShader, fragmentShader });
  });

  const cube = new THREE.BoxGeometry(size, size, size);
  cube.computeTangents();
  const cells = new Cells(lights);
  const reach = RANGE + (size / 2) * Math.sqrt(3);
  const meshes = grouped(objects).map(([group, members]) => {
    const geometry = cube.clone();
    const mesh = instances(THREE, geometry, surfaces[group % materials], members.length);
    const chosen = new THREE.InstancedBufferAttribute(new Float32Array(members.length * 3), 3);
    geometry.setAttribute('chosen', chosen.setUsage(THREE.DynamicDrawUsage));
    scene.add(mesh);
    return { mesh, chosen, members };
  });
  const move = (seconds) => {
    for (const { mesh, chosen, members } of meshes) {
      const matrices = mesh.instanceMatrix.array;
      members.forEach((object, i) => {
        pose(object, seconds, matrices, i * 16);
        cells.choose(matrices[i * 16 + 12], matrices[i * 16 + 13], matrices[i * 16 + 14], reach, chosen.array, i * 3);
      });
      mesh.instanceMatrix.needsUpdate = true;
      chosen.needsUpdate = true;
    }
  };
  move(0);
  // As far as they ever move.
  for (const { mesh } of meshes) {
    mesh.computeBoundingSphere();
    mesh.boundingSphere.radius += 1;
  }
  return {
    canvas,
    revision: THREE.REVISION,
    ...reader(renderer.getContext()),
    move,
    draw: () => renderer.render(scene, camera),
    draws: () => renderer.info.render.calls,
  };
}
