"""What a page looks like, by its DOM: in view, not covered, readable, reached by the keyboard."""

from __future__ import annotations

from typing import Any

VIEWS = {"desktop": (1440, 900), "wide": (1366, 768), "tablet": (1024, 768), "phone": (390, 844)}
_PROBLEMS = """() => {
  const found = [], view = document.documentElement;
  const seen = (one) => one.checkVisibility({visibilityProperty: true, opacityProperty: true});
  const name = (one) => (one.ariaLabel || one.textContent || one.id || one.className).trim().slice(0, 60);
  if (view.scrollWidth > view.clientWidth || view.scrollHeight > view.clientHeight) found.push('the page scrolls');

  const always = ['.armtempo-stop', '#armtempo-state', '#armtempo-where', '#armtempo-said', '.armtempo-tabs'];
  if (seen(document.querySelector('.armtempo-banner'))) always.push('.armtempo-banner');
  for (const selector of always) {
    const box = document.querySelector(selector).getBoundingClientRect();
    if (box.left < 0 || box.top < 0 || box.right > view.clientWidth + 1 || box.bottom > view.clientHeight + 1)
      found.push(`out of view: ${selector}`);
  }

  // What a pointer finds in the middle of each control that is scrolled to
  const controls = [...document.querySelectorAll('button, input, [role=slider], [role=tab]')].filter(
    (one) => seen(one) && !one.closest('[role=dialog], .q-notification') && one.getBoundingClientRect().width > 0);
  for (const one of controls) {
    one.scrollIntoView({block: 'nearest', inline: 'nearest'});
    const {x, y, width, height, left, right} = one.getBoundingClientRect();
    if (left < -1 || right > view.clientWidth + 1) found.push(`out of view: ${name(one)}`);
    const [across, down] = [x + width / 2, y + height / 2];
    const on = document.elementFromPoint(across, down);
    const field = one.closest('.q-field, .q-slider, .q-toggle, .q-checkbox, button, [role=tab]') || one;
    if (on && !field.contains(on) && !on.contains(one)) found.push(`covered: ${name(one)} by ${name(on)}`);
  }

  for (const label of document.querySelectorAll('.q-field--float .q-field__label')) {
    const value = label.closest('.q-field').querySelector('.q-field__native');
    if (!value || !seen(label)) continue;
    const box = value.getBoundingClientRect(), style = getComputedStyle(value);
    const middle = (box.top + parseFloat(style.paddingTop) + box.bottom - parseFloat(style.paddingBottom)) / 2;
    if (label.getBoundingClientRect().bottom > middle) found.push(`label over its value: ${name(label)}`);
  }

  // Contrast of text, WCAG 2.1: 4.5 to 1, or 3 to 1 if it is large
  const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((value) => value / 255)
    .map((value) => (value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
    .reduce((sum, value, i) => sum + value * [0.2126, 0.7152, 0.0722][i], 0);
  const over = (front, back) => back.map((value, i) => value + (front[i] - value) * (front[3] ?? 1));
  const behind = (one) => {
    const layers = [];
    for (let at = one; at; at = at.parentElement) layers.push(numbers(getComputedStyle(at).backgroundColor));
    return layers.reverse().reduce((back, front) => (front.length < 3 ? back : over(front, back)), [255, 255, 255]);
  };
  for (const one of document.querySelectorAll('.armtempo-page *')) {
    const own = [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || !seen(one) || one.closest('.disabled, [disabled], svg, .armtempo-scene, i')) continue;
    const style = getComputedStyle(one), back = behind(one);
    let alpha = 1;
    for (let at = one; at; at = at.parentElement) alpha *= Number(getComputedStyle(at).opacity);
    const colour = numbers(style.color);
    const front = over([...colour.slice(0, 3), (colour[3] ?? 1) * alpha], back);
    const [high, low] = [light(front), light(back)].sort((a, b) => b - a);
    const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.6 && style.fontWeight >= 700);
    if ((high + 0.05) / (low + 0.05) < (large ? 3 : 4.5))
      found.push(`contrast ${((high + 0.05) / (low + 0.05)).toFixed(1)}: ${name(one)}`);
  }
  return found;
}"""


def problems(page: Any) -> list[str]:
    """What is out of view, covered, or hard to read on the page as it is."""
    found: list[str] = page.evaluate(_PROBLEMS)
    return found
