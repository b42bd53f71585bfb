// The picture of what is seen, with names, legend and scale: to be saved and printed.
import { byId, element } from './dom.js';

const MARGIN_PX = 14;
const LINE_PX = 18;
const SWATCH_PX = 14;

// Texts over the canvas, where they are on the screen.
function drawLabels(context, container) {
  const { left, top } = container.getBoundingClientRect();
  context.textAlign = 'center';
  for (const label of container.children) {
    if (label.hidden) continue;
    const box = label.getBoundingClientRect();
    const lines = label.innerText.split('\n').filter((line) => line);
    const style = getComputedStyle(label);
    lines.forEach((line, i) => {
      const y = box.top - top + ((i + 0.5) * box.height) / lines.length;
      context.font = `${i === 0 ? style.fontWeight : 400} ${style.fontSize} ${style.fontFamily}`;
      drawHaloed(context, line, box.left - left + 0.5 * box.width, y);
    });
  }
}

function drawHaloed(context, text, x, y) {
  context.textBaseline = 'middle';
  context.lineWidth = 4;
  context.lineJoin = 'round';
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}

// The legend's entries in a row, below the picture.
function drawLegend(context, entries, width_px, top_px) {
  let [x, y] = [MARGIN_PX, top_px];
  context.textAlign = 'left';
  for (const entry of entries) {
    const text_px = context.measureText(entry.textContent).width;
    const swatch = entry.querySelector('.swatch');
    const needed_px = text_px + (swatch ? SWATCH_PX + 6 : 0);
    if (x > MARGIN_PX && x + needed_px > width_px - MARGIN_PX) [x, y] = [MARGIN_PX, y + LINE_PX];
    if (swatch) {
      const { fillStyle } = context;
      context.fillStyle = swatch.style.getPropertyValue('--colour');
      context.fillRect(x, y - 2, SWATCH_PX, 4);
      context.fillStyle = fillStyle;
    }
    context.fillText(entry.textContent, x + needed_px - text_px, y);
    x += needed_px + 2 * MARGIN_PX;
  }
  return y;
}

function drawScale(context, bar, right_px, y) {
  const width_px = bar.offsetWidth;
  context.fillRect(right_px - width_px, y, width_px, 2);
  context.textAlign = 'center';
  context.fillText(bar.textContent, right_px - 0.5 * width_px, y - 9);
}

// Draws the canvas of the page's view, which has just been drawn, and what lies over it.
export function composePicture({ view, map }) {
  const { width, height } = view.size;
  const ratio = view.canvas.width / width;
  const below_px = 4 * LINE_PX;
  const picture = element('canvas', { width: view.canvas.width, height: (height + below_px) * ratio });
  const context = picture.getContext('2d');
  const style = getComputedStyle(document.body);
  context.scale(ratio, ratio);
  context.fillStyle = style.backgroundColor;
  context.fillRect(0, 0, width, height + below_px);
  context.drawImage(view.canvas, 0, 0, width, height);
  context.strokeStyle = style.backgroundColor;
  context.fillStyle = style.color;
  drawLabels(context, byId('labels'));
  context.font = `600 ${style.fontSize} ${style.fontFamily}`;
  context.textAlign = 'left';
  drawHaloed(context, map.document.title, MARGIN_PX, MARGIN_PX);
  context.font = `400 12px ${style.fontFamily}`;
  drawLegend(context, byId('legend').children, width, height + LINE_PX);
  if (view.mode === 'plan') drawScale(context, byId('scale'), width - MARGIN_PX, height - MARGIN_PX);
  return picture;
}

export function saveBlob(blob, name) {
  const url = URL.createObjectURL(blob);
  element('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1e4);
}

export function savePicture(picture, title) {
  picture.toBlob((blob) => saveBlob(blob, `${title}.png`));
}

// Paper shows the picture alone; where it is wider than high, the sheet lies.
export function printPicture(picture) {
  const image = byId('paper');
  image.src = picture.toDataURL();
  image.decode().then(() => window.print());
}
