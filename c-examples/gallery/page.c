/* Sentences that compare are made from the numbers of the run. */
#include "page.h"

#include <stdio.h>

static const char *const metrics[2] = {"absolute", "relative"};

/* The error of one method over that of another. */
static double gain(const Result *r, int of, int over, bool relative) {
    const Score *a = &r->verdict.score[of], *b = &r->verdict.score[over];
    double x = relative ? a->relative : a->absolute, y = relative ? b->relative : b->absolute;
    return x == y ? 1.0 : x / y;
}

/* Samples of one method at a pixel over those of another. */
static double more(const Result *r, int of, int over) {
    return r->verdict.samples[of] / r->verdict.samples[over];
}

const char *page_light(const Result *r) {
    return r->other_map != NULL ? r->other_map : r->has_map ? r->picture->light : "a sun and windows";
}

/* The first lines of a table. */
static void head(FILE *f, const char *names, int columns) {
    fprintf(f, "| %s |\n|", names);
    while (columns-- > 0) {
        fputs(" --- |", f);
    }
    fputc('\n', f);
}

/* "wis_direct has 2.1 to 9.3 times lower relative MSE than MIS in 6 of 6 pictures" */
static void write_verdicts(FILE *f, const Page *page) {
    static const char *const names[2] = {"MIS", "compensated MIS"};
    head(f, "against | metric | pictures that wis_direct wins | least gain | largest gain", 5);
    for (int k = 0; k < 4; k++) {
        double least = INFINITY, most = 0.0;
        uint32_t won = 0;
        for (uint32_t i = 0; i < page->count; i++) {
            double times = gain(&page->results[i], k / 2 == 0 ? MIS : COMPENSATED, DIRECT, k % 2 == 0);
            least = fmin(least, times);
            most = fmax(most, times);
            won += times > 1.0;
        }
        fprintf(f, "| %s | %s MSE | %u of %u | %.2fx | %.2fx |\n", names[k / 2], metrics[k % 2 == 0], won, page->count, least, most);
    }
}

static void write_gains(FILE *f, const Page *page) {
    head(f, "picture | relative MSE, MIS / direct | absolute MSE, MIS / direct | relative MSE, compensated / direct | absolute MSE, "
            "compensated / direct | relative MSE, MIS / direct with visibility | absolute MSE, MIS / direct with visibility", 7);
    for (uint32_t i = 0; i < page->count; i++) {
        static const int pairs[3][2] = {{MIS, DIRECT}, {COMPENSATED, DIRECT}, {MIS, REMEMBERING}};
        fprintf(f, "| %s |", page->results[i].picture->name);
        for (int k = 0; k < 6; k++) {
            fprintf(f, " %.2fx |", gain(&page->results[i], pairs[k / 2][0], pairs[k / 2][1], k % 2 == 0));
        }
        fputc('\n', f);
    }
}

/* What the gain would be if a sample cost the same by all methods: errors are taken to fall with the number of samples. */
static void write_per_sample(FILE *f, const Page *page) {
    head(f, "picture | cost of a sample, direct / MIS | relative MSE, MIS / direct | absolute MSE, MIS / direct | relative MSE, "
            "compensated / direct | absolute MSE, compensated / direct", 6);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        fprintf(f, "| %s | %.2fx |", r->picture->name, more(r, MIS, DIRECT) * r->verdict.seconds[DIRECT] / r->verdict.seconds[MIS]);
        for (int k = 0; k < 4; k++) {
            int other = k / 2 == 0 ? MIS : COMPENSATED;
            fprintf(f, " %.2fx |", more(r, other, DIRECT) * gain(r, other, DIRECT, k % 2 == 0));
        }
        fputc('\n', f);
    }
}

static void write_errors(FILE *f, const Page *page) {
    static const char *const names[METHODS] = {"MIS", "compensated MIS", "`wis_direct`", "with a visibility cache"};
    head(f, "picture | method | seconds | samples at a pixel | relative MSE | absolute MSE", 6);
    for (uint32_t i = 0; i < page->count; i++) {
        const Verdict *v = &page->results[i].verdict;
        const char *name = page->results[i].picture->name;
        for (int m = 0; m < METHODS; m++) {
            fprintf(f, "| %s | %s | %.2f | %.1f | %.5f | %.5f |\n", name, names[m], v->seconds[m], v->samples[m], v->score[m].relative,
                    v->score[m].absolute);
        }
        fprintf(f, "| %s | the reference's own noise | %.0f | | %.5f | %.5f |\n", name, 2.0 * page->reference_seconds,
                v->reference.relative, v->reference.absolute);
    }
}

static void write_counts(FILE *f, const Page *page) {
    if (page->small == NULL) {
        return;
    }
    fputs("| picture | metric |", f);
    for (uint32_t k = 0; k < COUNTS; k++) {
        fprintf(f, " %u samples |", page->counts[k]);
    }
    fputs("\n| --- | --- | --- | --- | --- | --- |\n", f);
    for (uint32_t i = 0; i < 2 * page->count; i++) {
        fprintf(f, "| %s | %s |", page->results[i / 2].picture->name, metrics[i % 2 == 0]);
        for (uint32_t k = 0; k < COUNTS; k++) {
            fprintf(f, " %.2fx |", gain(&page->small[i / 2][k], MIS, DIRECT, i % 2 == 0));
        }
        fputc('\n', f);
    }
}

static void write_inputs(FILE *f, const Page *page) {
    head(f, "picture | mesh | surface | map | light", 5);
    for (uint32_t i = 0; i < page->count; i++) {
        const Result *r = &page->results[i];
        const char *map = r->other_map != NULL ? r->other_map : r->has_map ? r->picture->map : "sky of the project's own";
        fprintf(f, "| %s | %s | %s | %s | %s |\n", r->picture->name, r->has_mesh ? r->picture->mesh : "knot of the project's own",
                r->picture->surface, map, page_light(r));
    }
}

static void write_pictures(FILE *f, const Page *page) {
    for (uint32_t i = 0; i < page->count; i++) {
        const Picture *p = page->results[i].picture;
        if (p->in_page) {
            fprintf(f, "![%s: MIS, wis_direct, reference](gallery/%s.png)\n\n*A part of **%s**: %s; %s. MIS and `wis_direct` took "
                       "%.1f s each. The relative MSE is\nthat of the whole picture.*\n\n",
                    p->name, p->name, p->name, p->surface, p->light, page->results[i].verdict.seconds[DIRECT]);
        }
    }
}

bool page_write(const Page *page, const char *path) {
    static const struct { const char *name; void (*write)(FILE *f, const Page *page); } parts[] = {
        {"verdicts", write_verdicts}, {"pictures", write_pictures}, {"gains", write_gains}, {"per sample", write_per_sample},
        {"errors", write_errors}, {"counts", write_counts}, {"inputs", write_inputs}};
    FILE *f = path != NULL ? fopen(path, "w") : stdout;
    for (size_t i = 0; f != NULL && i < sizeof parts / sizeof parts[0]; i++) {
        fprintf(f, "=== %s\n", parts[i].name);
        parts[i].write(f, page);
    }
    return f != NULL && fprintf(f, "=== size\n%u x %u\n=== seconds\n%.1f\n=== samples\n%u\n=== reference\n%.0f\n", page->width, page->height,
                                page->seconds, page->samples, page->reference_seconds) > 0 && fclose(f) == 0;
}
