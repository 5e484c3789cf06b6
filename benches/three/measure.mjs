// Serves this folder to a browser without a window, waits for its figures and prints them as one line of JSON.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { extname, join } from 'node:path';

const usage = 'usage: node measure.mjs OBJECTS LIGHTS WIDTHxHEIGHT wide|inside still|moving [nearest|clustered]';
const [objects, lights, size, view, motion, how = 'nearest'] = process.argv.slice(2);
const [width, height] = (size ?? '').split('x').map(Number);
const known = (value, values) => values.includes(value);
if (!(objects > 0 && lights >= 0 && width > 0 && height > 0) || !known(view, ['wide', 'inside'])
  || !known(motion, ['still', 'moving']) || !known(how, ['nearest', 'clustered'])) {
  console.error(usage);
  process.exit(2);
}
const folder = import.meta.dirname;
if (!existsSync(join(folder, 'node_modules/three'))) {
  console.error(`${folder}: expected three in node_modules; run npm install there`);
  process.exit(2);
}
const { FRAMES = '60', SECONDS = '40', TILES = '1', ROOM = '64', SHOT = '', CHROMIUM = 'chromium' } = process.env;
const { FLAGS = '--use-gl=angle --use-angle=gl-egl --ignore-gpu-blocklist' } = process.env;

const types = { '.html': 'text/html', '.js': 'text/javascript', '.json': 'application/json' };
const profile = mkdtempSync(join(tmpdir(), 'yard-'));
let browser;
let stopping = false;

function stop(code) {
  stopping = true;
  try {
    // The browser's other processes, too, which still write to the profile.
    process.kill(-browser.pid, 'SIGKILL');
  } catch {
    // None is left.
  }
  setTimeout(() => {
    rmSync(profile, { recursive: true, force: true, maxRetries: 10 });
    process.exit(code);
  }, 500);
}

/** The most memory, in units of 2²⁰ bytes, that the browser's processes of a kind ever had, added up. */
function peak(...kinds) {
  let total = 0;
  for (const process of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const command = readFileSync(`/proc/${process}/cmdline`, 'utf8');
      if (command.includes(profile) && kinds.some((kind) => command.includes(`--type=${kind}`))) {
        const status = readFileSync(`/proc/${process}/status`, 'utf8');
        total += Number(/VmHWM:\s*(\d+)/.exec(status)[1]) / 1024;
      }
    } catch {
      // It ended meanwhile.
    }
  }
  return total;
}

const server = createServer((request, response) => {
  // Isolated, so that the clock is as fine as it gets.
  response.setHeader('Cross-Origin-Opener-Policy', 'same-origin');
  response.setHeader('Cross-Origin-Embedder-Policy', 'require-corp');
  if (request.method === 'POST') {
    const parts = [];
    request.on('data', (part) => parts.push(part));
    request.on('end', () => {
      response.end();
      const body = Buffer.concat(parts);
      if (request.url === '/shot') {
        writeFileSync(SHOT, body);
      } else if (request.url === '/done') {
        console.log(JSON.stringify({ ...JSON.parse(body), rss_mb: peak('renderer', 'gpu-process') }));
        stop(0);
      } else {
        console.error(body.toString());
        stop(1);
      }
    });
    return;
  }
  const path = join(folder, decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  if (!path.startsWith(folder) || !existsSync(path) || !statSync(path).isFile()) {
    response.writeHead(404).end();
    return;
  }
  response.writeHead(200, { 'Content-Type': types[extname(path)] ?? 'application/octet-stream' });
  response.end(readFileSync(path));
});

server.listen(0, '127.0.0.1', () => {
  const query = new URLSearchParams({
    objects, lights, width, height, view, motion, how, tiles: TILES, room: ROOM, frames: FRAMES, seconds: SECONDS, shot: SHOT,
  });
  const address = `http://127.0.0.1:${server.address().port}/yard.html?${query}`;
  const flags = ['--headless=new', '--no-sandbox', '--no-first-run', `--user-data-dir=${profile}`, ...FLAGS.split(' ')];
  browser = spawn(CHROMIUM, [...flags, address], { stdio: 'ignore', detached: true });
  browser.on('error', (error) => {
    console.error(`${CHROMIUM}: ${error.message}; CHROMIUM names the browser`);
    rmSync(profile, { recursive: true, force: true });
    process.exit(2);
  });
  browser.on('exit', () => {
    if (stopping) return;
    console.error('the browser ended before the page was done');
    stop(1);
  });
});
setTimeout(() => {
  console.error('the page took longer than ten minutes');
  stop(1);
}, 600_000);
