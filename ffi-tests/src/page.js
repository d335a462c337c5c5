addEventListener('load', () => {
  const images = [...document.images], plots = [...document.querySelectorAll('figure svg')];
  const drawn = plots.filter(p => p.getBoundingClientRect().width > 100 || p.closest('details:not([open])'));
  const shown = images.filter(i => i.complete && i.naturalWidth >= 480);
  const fits = document.documentElement.scrollWidth <= innerWidth;
  Object.assign(document.documentElement.dataset, { images: shown.length + '/' + images.length,
    plots: drawn.length + '/' + plots.length, fits });
});
