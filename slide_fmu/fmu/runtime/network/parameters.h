/* Physical parameters that the weights of a cell follow (slide_fmu/network/state_space/
 * polynomial.py): weights = constant term + sum over the terms of phi_k(parameters) times theirs.
 * The weights are formed when the parameters change; then a step costs what it does without. */
#ifndef SLIDE_PARAMETERS_H
#define SLIDE_PARAMETERS_H

#include "arena.h"
#include "reading.h"

enum { SLIDE_MOST_TERMS = 63, SLIDE_MOST_DEGREE = 16 };

/* What of a parameter the polynomials are of. */
typedef enum { SLIDE_LINEAR, SLIDE_LOG, SLIDE_RECIPROCAL } SlideTransform;

/* In a file, whose bytes have been checked. */
typedef struct {
    uint32_t count, n_terms;      /* terms beside the constant one */
    const unsigned char *rows;    /* [count]: f64 low, high, start, u32 transform, 0 */
    const unsigned char *degrees; /* u32 [n_terms][count] */
    const unsigned char *weights; /* f32 [n_terms][those of a cell] */
} SlideParametersView;

/* Take a section with the parameters of a cell that has so many weights. */
void slide_parameters_read(SlideParametersView *view, uint64_t n_weights, SlideCursor *cursor);

enum { SLIDE_MOST_MATRICES = 12 };

/* A matrix of weights in the layout of the kernels, for the values that count now, and of the
 * constant term. */
typedef struct {
    float *now;            /* [size] */
    const float *constant; /* [size] */
    size_t size;
} SlideTermMatrix;

/* The matrices of a cell whose weights follow parameters; else there are none. */
typedef struct {
    size_t count;   /* of matrices */
    size_t n_terms; /* beside the constant one */
    size_t stride;  /* floats from a matrix of a term to the same one of the next */
    SlideTermMatrix matrices[SLIDE_MOST_MATRICES];
} SlideTerms;

typedef struct {
    uint32_t count, n_terms;
    double *low, *high, *start; /* [count], physical */
    SlideTransform *transforms; /* [count] */
    uint32_t *degrees;          /* [n_terms][count] */
    double *powers; /* scratch [count][1 + SLIDE_MOST_DEGREE], the Chebyshev polynomials */
    double *phi;    /* scratch [n_terms] */
    double *formed; /* [count], the values for which the weights are; not numbers at first */
} SlideParameters;

void slide_parameters_place(SlideParameters *parameters, const SlideParametersView *view,
                            SlideArena *arena);

/* Form the weights for values [count] in the parameters' ranges, if they are those of others. */
void slide_parameters_form(const SlideParameters *parameters, const SlideTerms *terms,
                           const double *values);

/* The same for values whose scaled transforms are moved by an amount times a direction [count]. The
 * next call of slide_parameters_form forms the weights anew. */
void slide_parameters_form_near(const SlideParameters *parameters, const SlideTerms *terms,
                                const double *values, const double *direction, double amount);

/* The derivative of a parameter's scaled transform by the parameter. */
double slide_parameter_slope(const SlideParameters *parameters, size_t index, double value);

/* How far a value may lie outside its range by rounding; it is then taken as its end. */
bool slide_parameter_in_range(const SlideParameters *parameters, size_t index, double value);
double slide_parameter_within(const SlideParameters *parameters, size_t index, double value);

#endif
