'use strict';
(() => {
  const exhibits = JSON.parse(document.getElementById('exhibits').textContent);
  const canvas = document.getElementById('canvas');
  const picture = document.getElementById('picture');
  const part = document.getElementById('part');
  const list = document.getElementById('list');

  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFShadowMap;
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  renderer.toneMappingExposure = 1.05;
  const scene = new THREE.Scene();
  const sky = new THREE.Color('#dfe7ee');
  scene.background = sky;
  const camera = new THREE.PerspectiveCamera(28, 1, 0.2, 4000);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.maxPolarAngle = Math.PI / 2 - 0.01;
  scene.add(new THREE.HemisphereLight('#dce8f5', '#8a8575', 2.1));
  const sun = new THREE.DirectionalLight('#fff1dc', 3.0);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.normalBias = 0.03;
  scene.add(sun, sun.target);
  const ground = new THREE.Mesh(
    new THREE.CircleGeometry(1, 96),
    new THREE.MeshStandardMaterial({ color: '#c3c9b6', roughness: 1 }));
  ground.rotation.x = -Math.PI / 2;
  ground.receiveShadow = true;
  scene.add(ground);
  let shown = null;

  function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  }

  function draw() {
    renderer.render(scene, camera);
  }

  function fit(model) {
    const box = new THREE.Box3().setFromObject(model);
    const centre = box.getCenter(new THREE.Vector3());
    const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 0.5);
    const narrow = Math.min(1, camera.aspect);
    const distance = radius / Math.sin((camera.fov * Math.PI) / 360) / narrow * 0.86;
    const towards = new THREE.Vector3(-0.52, 0.2, 0.85).normalize();
    camera.position.copy(centre).addScaledVector(towards, distance);
    camera.near = radius / 50;
    camera.far = distance + 40 * radius;
    camera.updateProjectionMatrix();
    controls.target.copy(centre);
    sun.target.position.copy(centre);
    sun.position.copy(centre).add(new THREE.Vector3(-0.62, 0.85, 0.45).normalize().multiplyScalar(3 * radius));
    const lens = sun.shadow.camera;
    lens.left = lens.bottom = -1.3 * radius;
    lens.right = lens.top = 1.3 * radius;
    lens.near = 0.1;
    lens.far = 6 * radius;
    lens.updateProjectionMatrix();
    ground.position.y = box.min.y - 0.01;
    ground.scale.setScalar(14 * radius);
    scene.fog = new THREE.Fog(sky, distance + 1.5 * radius, distance + 11 * radius);
    controls.update();
  }

  async function show(index) {
    const exhibit = exhibits[index];
    part.textContent = '';
    list.querySelectorAll('button').forEach((button, at) => {
      button.setAttribute('aria-current', String(at === index));
    });
    picture.hidden = exhibit.kind !== 'picture';
    if (exhibit.kind === 'picture') {
      picture.src = 'data:image/png;base64,' + exhibit.data;
      picture.alt = exhibit.name;
      return;
    }
    const model = (await new THREE.GLTFLoader().parseAsync(bytes(exhibit.data), '')).scene;
    model.traverse((node) => {
      if (node.isMesh) {
        node.castShadow = true;
        node.receiveShadow = true;
      }
    });
    if (shown) {
      scene.remove(shown);
      shown.traverse((node) => node.isMesh && node.geometry.dispose());
    }
    shown = model;
    scene.add(model);
    fit(model);
    draw();
    document.body.dataset.shown = exhibit.name;
  }

  function resize() {
    const { clientWidth, clientHeight } = canvas.parentElement;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(clientWidth, clientHeight, false);
    camera.aspect = clientWidth / Math.max(clientHeight, 1);
    camera.updateProjectionMatrix();
    draw();
  }

  function partName(node) {
    while (node && !node.name) node = node.parent;
    return node ? node.name : '';
  }

  canvas.addEventListener('click', (event) => {
    const area = canvas.getBoundingClientRect();
    const ray = new THREE.Raycaster();
    const x = ((event.clientX - area.left) / area.width) * 2 - 1;
    const y = 1 - ((event.clientY - area.top) / area.height) * 2;
    ray.setFromCamera(new THREE.Vector2(x, y), camera);
    const hit = shown && ray.intersectObject(shown, true)[0];
    const name = hit ? (hit.object.parent.userData.name || hit.object.userData.name || partName(hit.object)) : '';
    part.textContent = name;
  });

  exhibits.forEach((exhibit, index) => {
    const button = document.createElement('button');
    button.textContent = exhibit.name;
    button.addEventListener('click', () => show(index));
    list.append(button);
  });
  list.hidden = exhibits.length < 2;
  list.style.display = exhibits.length < 2 ? 'none' : '';
  controls.addEventListener('change', draw);
  window.addEventListener('resize', resize);
  resize();
  if (exhibits.length) show(0);
})();
