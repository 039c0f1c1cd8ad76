/* Signals of many records, and the way back from them: sample by sample what the sets of features
 * are (features/), formed once for each sample of a record and several at a time. Surrogates of
 * cells with sets that are not among these are refused when they are opened
 * (slide_records_know). */
#include "record_chain_back.h"
#include "record_director.h"

void SLIDE_RECORD(signals)(const SlideFeatures *features, const SlidePoints *points) {
    if (features->set == &slide_chain_motion) {
        form_chain(features, points);
    } else if (features->set == &slide_director) {
        form_directors(features, points);
    } else if (features->set == &slide_differences) {
        form_differences(features, points);
    }
}

void SLIDE_RECORD(pull_signals)(const SlideFeatures *features, const SlidePoints *points) {
    if (features->set == &slide_chain_motion) {
        pull_chain(features, points);
    } else if (features->set == &slide_director) {
        pull_directors(features, points);
    } else if (features->set == &slide_differences) {
        pull_differences(features, points);
    }
}
