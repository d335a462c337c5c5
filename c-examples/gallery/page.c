/* Sentences that compare are made from the numbers of the run. */
#include "page.h"

#include <stdio.h>
#include <string.h>

/* The error of method `a` over that of method `b`. */
static double gain(const Result *r, int a_method, int b_method, bool relative) {
    const Score *a = &r->score[a_method], *b = &r->score[b_method];
    double of_a = relative ? a->relative : a->absolute, of_b = relative ? b->relative : b->absolute;
    return of_a == of_b ? 1.0 : of_a / of_b;
}

static double ratio(const Result *r, int other, bool relative) {
    return gain(r, other, DIRECT, relative);
}

static const char *mesh_of(const Result *r) {
    return r->has_mesh ? r->picture->mesh : "knot of the project's own";
}

static const char *map_of(const Result *r) {
    return r->other_map != NULL ? r->other_map : r->has_map ? r->picture->map : "sky of the project's own";
}

/* "wis_direct has 2.1 to 9.3 times lower relative MSE than MIS in 6 of 6 pictures" */
static void write_verdict(FILE *f, const Page *page, int other, const char *name) {
    static const char *const metrics[2] = {"relative MSE", "absolute MSE"};
    for (int m = 0; m < 2; m++) {
        double least = INFINITY, most = 0.0;
        uint32_t won = 0;
        for (uint32_t i = 0; i < page->count; i++) {
            double times = ratio(&page->results[i], other, m == 0);
            least = fmin(least, times);
            most = fmax(most, times);
            won += times > 1.0;
        }
        fprintf(f, "| %s | %s | %u of %u | %.2fx | %.2fx |\n", name, metrics[m], won, page->count, least, most);
    }
}

static void write_verdicts(FILE *f, const Page *page) {
    fputs("| against | metric | pictures that wis_direct wins | least gain | largest gain |\n| --- | --- | --- | --- | "
          "--- |\n", f);
    write_verdict(f, page, MIS, "MIS");
    write_verdict(f, page, COMPENSATED, "compensated MIS");
}

static void write_gains(FILE *f, const Page *page) {
    fputs("| picture | relative MSE, MIS / direct | absolute MSE, MIS / direct | relative MSE, compensated / direct | "
          "absolute MSE, compensated / direct | relative MSE, MIS / direct with visibility | absolute MSE, MIS / direct "
          "with visibility |\n"
          "| --- | --- | --- | --- | --- | --- | --- |\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        fprintf(f, "| %s | %.2fx | %.2fx | %.2fx | %.2fx | %.2fx | %.2fx |\n", r->picture->name, ratio(r, MIS, true),
                ratio(r, MIS, false), ratio(r, COMPENSATED, true), ratio(r, COMPENSATED, false),
                gain(r, MIS, REMEMBERING, true), gain(r, MIS, REMEMBERING, false));
    }
}

/* What the gain would be if a sample cost the same by all methods: errors are taken to fall with the number of samples. */
static void write_per_sample(FILE *f, const Page *page) {
    fputs("| picture | cost of a sample, direct / MIS | relative MSE, MIS / direct | absolute MSE, MIS / direct | "
          "relative MSE, compensated / direct | absolute MSE, compensated / direct |\n"
          "| --- | --- | --- | --- | --- | --- |\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        double more = r->samples[MIS] / r->samples[DIRECT], more_compensated = r->samples[COMPENSATED] / r->samples[DIRECT];
        fprintf(f, "| %s | %.2fx | %.2fx | %.2fx | %.2fx | %.2fx |\n", r->picture->name, more * r->seconds[DIRECT] / r->seconds[MIS],
                more * ratio(r, MIS, true), more * ratio(r, MIS, false), more_compensated * ratio(r, COMPENSATED, true),
                more_compensated * ratio(r, COMPENSATED, false));
    }
}

static void write_errors(FILE *f, const Page *page) {
    static const char *const names[METHODS] = {"MIS", "compensated MIS", "`wis_direct`", "with a visibility cache"};
    fputs("| picture | method | seconds | samples at a pixel | relative MSE | absolute MSE |\n| --- | --- | --- | --- | "
          "--- | --- |\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        for (int m = 0; m < METHODS; m++) {
            fprintf(f, "| %s | %s | %.2f | %.1f | %.5f | %.5f |\n", r->picture->name, names[m], r->seconds[m], r->samples[m],
                    r->score[m].relative, r->score[m].absolute);
        }
        fprintf(f, "| %s | the reference's own noise | %.0f | | %.5f | %.5f |\n", r->picture->name, 2.0 * page->reference_seconds,
                r->reference.relative, r->reference.absolute);
    }
}

static void write_counts(FILE *f, const Page *page) {
    fputs("| picture | metric |", f);
    for (uint32_t k = 0; k < COUNTS; k++) {
        fprintf(f, " %u samples |", page->counts[k]);
    }
    fputs("\n| --- | --- | --- | --- | --- | --- |\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        for (int m = 0; m < 2; m++) {
            fprintf(f, "| %s | %s |", page->results[i].picture->name, m == 0 ? "relative" : "absolute");
            for (uint32_t k = 0; k < COUNTS; k++) {
                fprintf(f, " %.2fx |", ratio(&page->small[i][k], MIS, m == 0));
            }
            fputc('\n', f);
        }
    }
}

static void write_inputs(FILE *f, const Page *page) {
    fputs("| picture | mesh | surface | map | light |\n| --- | --- | --- | --- | --- |\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        fprintf(f, "| %s | %s | %s | %s | %s |\n", r->picture->name, mesh_of(r), r->picture->surface, map_of(r),
                judge_light(r));
    }
}

void page_print(const Page *page) {
    write_gains(stdout, page);
    putchar('\n');
    write_per_sample(stdout, page);
    putchar('\n');
    write_errors(stdout, page);
    if (page->small != NULL) {
        putchar('\n');
        write_counts(stdout, page);
    }
}

bool page_write_markdown(const Page *page, const char *path) {
    FILE *f = fopen(path, "w");
    if (f == NULL) {
        return false;
    }
    fputs("# Gallery\n\nDirect light in six pictures. Each method had the same processor time.\n\n", f);
    write_verdicts(f, page);
    fputs("\nAbove 1x, `wis_direct` has the lower error. It loses in two cases:\n\n"
          "- The brightest light is blocked. Neither method knows that, but MIS spends half of its samples on the BRDF, "
          "whatever the light.\n"
          "- The surface is so diffuse, and the light so even, that the choice of rays gains less than it costs.\n\n"
          "Rays are cheap here and pixels have many, so each is chosen among 4 candidates: `candidates_per_ray`. The default pays where a ray costs\n"
          "half a microsecond and more.\n\n", f);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        if (r->picture->in_page) {
            fprintf(f, "![%s: MIS to the left, wis_direct to the "
                       "right](gallery/%s.png)\n\n", r->picture->name, r->picture->name);
            fprintf(f, "*A part of **%s**: %s; %s. MIS to the left, `wis_direct` to the right, %.1f s each.\nThe "
                       "relative MSE is "
                       "%.4f with MIS and %.4f with `wis_direct`.*\n\n", r->picture->name, r->picture->surface, r->picture->light,
                    r->seconds[DIRECT], r->score[MIS].relative, r->score[DIRECT].relative);
        }
    }
    fputs("## Gains at equal time\n\nError of the other method over that of `wis_direct`. Above 1x, `wis_direct` is "
          "better. With visibility: `wis_visibility_cache_record` notes what\nrays saw, for the passes that follow.\n\n", f);
    write_gains(f, page);
    fputs("\n## Gains at an equal number of samples\n\nThe same errors, scaled to as many samples: what remains where "
          "rays and BRDFs cost far more than the choice of a ray.\n"
          "Here they are cheap: Embree traces a mesh of at most 100,000 triangles, and a BRDF has two lobes at the "
          "most.\n\n", f);
    write_per_sample(f, page);
    fputs("\n## Errors\n\n", f);
    write_errors(f, page);
    if (page->small != NULL) {
        fputs("\n## More or fewer samples at a hit\n\nMSE of MIS over that of `wis_direct` at equal time, in pictures a "
              "quarter as wide. Above 1x, `wis_direct` is better.\n"
              "More samples at a hit mean fewer camera rays. Compare columns, not this table with the one above: a small\n"
              "picture has a sixteenth of the pixels, and single ones decide its relative MSE.\n\n", f);
        write_counts(f, page);
    }
    fputs("\n## What they show\n\n", f);
    write_inputs(f, page);
    fprintf(f, "\n## How it was measured\n\n`make gallery PAGE=1` wrote this page; `make gallery` writes the whole "
               "pictures, %u x %u pixels, to `build/gallery`.\n\n"
               "- Methods take turns, a pass each, until each has spent %.1f s of processor time. A pass traces one "
               "camera ray and takes %u samples\n"
               "  in each pixel. The time counts camera rays, sampling, BRDFs, radiance and shadow rays; Embree traces them.\n"
               "- MIS takes half of its samples from the light and half from the BRDF, with the balance heuristic. Its "
               "random numbers are an\n"
               "  Owen-scrambled Sobol sequence, which passes continue. `wis_direct` gets `sample`, and neither a "
               "visibility cache nor `u`.\n"
               "- Errors are of luminance, over the pixels that the set covers. Relative: d^2 / (truth^2 + 1e-4 "
               "mean^2); absolute: d^2 / mean^2.\n"
               "- The truth is the mean of two references of %.0f s each, one by compensated MIS and one by "
               "`wis_direct`. The product of the two\n"
               "  differences estimates d^2, so the references' noise is part of no error.\n"
               "- Only direct light is there: surfaces that see no part of the map are "
               "black.\n"
               "- Constants of the library were tuned on four of these maps: rooitou_park, venice_sunset, studio_small_03 and "
               "st_fagans_interior.\n", page->width, page->height, page->seconds, page->samples,
            page->reference_seconds);
    return fclose(f) == 0;
}

/* A table of Markdown, row by row, as HTML. */
static void write_table(FILE *f, const Page *page, void (*write)(FILE *, const Page *)) {
    FILE *rows = tmpfile();
    char line[1024];
    int number = 0;
    if (rows == NULL) {
        return;
    }
    write(rows, page);
    rewind(rows);
    fputs("<table>\n", f);
    while (fgets(line, sizeof line, rows) != NULL) {
        const char *tag = number == 0 ? "th" : "td";
        char *cell = strtok(line, "|\n");
        if (number++ == 1) {
            continue;
        }
        fputs("<tr>", f);
        for (; cell != NULL; cell = strtok(NULL, "|\n")) {
            fprintf(f, "<%s>%s</%s>", tag, cell, tag);
        }
        fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
    fclose(rows);
}

bool page_write_html(const Page *page, const char *folder) {
    char path[512];
    FILE *f;
    snprintf(path, sizeof path, "%s/index.html", folder);
    f = fopen(path, "w");
    if (f == NULL) {
        return false;
    }
    fputs("<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>wis: gallery</title>\n"
          "<meta name=\"viewport\" content=\"width=device-width\">\n"
          "<style>body { font: 16px sans-serif; margin: 2em auto; max-width: 1280px; padding: 0 1em }\n"
          "img { max-width: 100% } table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .2em .8em; "
          "text-align: left; border-bottom: 1px solid #ccc }</style>\n"
          "<h1>MIS and wis_direct at equal time</h1>\n<p>Above 1x, wis_direct has the lower error.</p>\n", f);
    write_table(f, page, write_verdicts);
    write_table(f, page, write_gains);
    for (uint32_t i = 0; i < page->count; i++) {
        const char *name = page->results[i].picture->name;
        fprintf(f, "<h2>%s</h2>\n<p><img src=\"%s.png\" alt=\"%s: MIS to the left, wis_direct to the right\">\n"
                   "<br><a href=\"%s-truth.png\">the reference</a>, <a href=\"%s-crop.png\">a part, "
                   "magnified</a></p>\n", name, name, name, name, name);
    }
    write_table(f, page, write_errors);
    if (page->small != NULL) {
        fputs("<p>MSE of MIS over that of wis_direct, by samples at a hit, in pictures a quarter as wide</p>\n", f);
        write_table(f, page, write_counts);
    }
    write_table(f, page, write_inputs);
    fputs("</html>\n", f);
    return fclose(f) == 0;
}
