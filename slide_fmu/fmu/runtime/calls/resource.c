#include "resource.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
#endif

static const char *const PAYLOAD = "surrogate.slide";

/* Find where the path of the URI begins, at its slash; NULL when it is no local file URI. */
static const char *begin_of_path(const char *uri) {
    const char *at = uri;
    for (const char *scheme = "file:"; *scheme != '\0'; ++scheme, ++at) {
        if (tolower((unsigned char)*at) != *scheme) {
            return NULL;
        }
    }
    if (strncmp(at, "//", 2) == 0) {
        at += 2;
        at += strncmp(at, "localhost/", 10) == 0 ? 9 : 0;
    }
    return *at == '/' ? at : NULL;
}

/* Replace percent escapes in place; false when one is malformed or gives the end of a string. */
static bool unescape(char *text) {
    char *to = text;
    for (const char *from = text; *from != '\0'; ++to) {
        if (*from != '%') {
            *to = *from++;
            continue;
        }
        if (!isxdigit((unsigned char)from[1]) || !isxdigit((unsigned char)from[2])) {
            return false;
        }
        const char digits[] = {from[1], from[2], '\0'};
        *to = (char)strtol(digits, NULL, 16);
        if (*to == '\0') {
            return false;
        }
        from += 3;
    }
    *to = '\0';
    return true;
}

/* The path of the surrogate file in the folder of the resources. Free the result. */
static char *path_of(const char *location, bool is_uri, SlideMessage *message) {
    const char *folder = location != NULL && is_uri ? begin_of_path(location) : location;
    if (folder == NULL) {
        slide_say(message, "%s %s; expected %s/path/to/resources/",
                  is_uri ? "fmuResourceLocation" : "the path of the resources",
                  location == NULL ? "is NULL" : location, is_uri ? "file://" : "");
        return NULL;
    }
    const size_t length = strlen(folder) + strlen(PAYLOAD) + 2;
    char *path = malloc(length);
    if (path == NULL) {
        slide_say(message, "out of memory");
        return NULL;
    }
    snprintf(path, length, "%s/%s", folder, PAYLOAD);
    if (is_uri && !unescape(path)) {
        slide_say(message, "fmuResourceLocation %s has a malformed percent escape", location);
        free(path);
        return NULL;
    }
#if defined(_WIN32)
    if (is_uri && path[1] != '\0' && path[2] == ':') { /* /C:/folder */
        memmove(path, path + 1, strlen(path));
    }
#endif
    return path;
}

#if defined(_WIN32)
static FILE *open_file(const char *path) {
    int length = MultiByteToWideChar(CP_UTF8, 0, path, -1, NULL, 0);
    wchar_t *wide = malloc((size_t)length * sizeof *wide);
    if (length < 1 || wide == NULL) {
        free(wide);
        return NULL;
    }
    MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, length);
    FILE *file = _wfopen(wide, L"rb");
    free(wide);
    return file;
}
#else
static FILE *open_file(const char *path) { return fopen(path, "rb"); }
#endif

unsigned char *slide_read_file(const char *path, size_t *size, SlideMessage *message) {
    FILE *file = open_file(path);
    const long end = file != NULL && fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    unsigned char *data = end < 0 ? NULL : malloc((size_t)end + 1);
    *size = (size_t)end;
    if (data != NULL && (fseek(file, 0, SEEK_SET) != 0 || fread(data, 1, *size, file) != *size)) {
        free(data);
        data = NULL;
    }
    if (data == NULL) {
        slide_say(message, "cannot read %s; was the FMU unpacked completely?", path);
    }
    if (file != NULL) {
        fclose(file);
    }
    return data;
}

const unsigned char *slide_surrogate_open(const char *location, bool is_uri, size_t *size,
                                          SlideMessage *message) {
    char *path = path_of(location, is_uri, message);
    unsigned char *data = path == NULL ? NULL : slide_read_file(path, size, message);
    free(path);
    return data;
}

void slide_surrogate_close(const unsigned char *data) { free((void *)data); }
