// What the report's 3-D view takes of three.js, and no more; tools/viewer/build bundles it.
export {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  NeutralToneMapping,
  PCFShadowMap,
  PerspectiveCamera,
  PlaneGeometry,
  PMREMGenerator,
  Raycaster,
  Scene,
  ShadowMaterial,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { toCreasedNormals } from 'three/addons/utils/BufferGeometryUtils.js';
export { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
