/* The tables of cost and error. */
#ifndef RENDER_REPORT_H
#define RENDER_REPORT_H

#include "session.h"

/* Prints the tables to stdout; overwrites session->difference. */
void report_print(const Session *session);

/* How many of the rendered colours are NaN or infinite. */
size_t report_not_finite(const Session *session);

#endif
