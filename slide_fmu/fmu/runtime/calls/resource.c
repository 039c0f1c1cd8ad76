#include "resource.h"

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
        char lower = *at >= 'A' && *at <= 'Z' ? (char)(*at + ('a' - 'A')) : *at;
        if (lower != *scheme) {
            return NULL;
        }
    }
    if (strncmp(at, "//", 2) == 0) {
        at += 2;
        at += strncmp(at, "localhost/", 10) == 0 ? 9 : 0;
    }
    return *at == '/' ? at : NULL;
}

static int hex_digit(char character) {
    const char *digits = "0123456789abcdef0123456789ABCDEF";
    const char *found = character == '\0' ? NULL : strchr(digits, character);
    return found == NULL ? -1 : (int)((found - digits) % 16);
}

/* Replace percent escapes in place; false when one is malformed or gives the end of a string. */
static bool unescape(char *text) {
    char *to = text;
    for (const char *from = text; *from != '\0'; ++to) {
        if (*from != '%') {
            *to = *from++;
            continue;
        }
        int high = hex_digit(from[1]);
        int low = high < 0 ? -1 : hex_digit(from[2]);
        if (low < 0 || high + low == 0) {
            return false;
        }
        *to = (char)(16 * high + low);
        from += 3;
    }
    *to = '\0';
    return true;
}

/* The path of the surrogate file in the folder of the resources. Free the result. */
static char *path_of(const char *location, bool is_uri, SlideMessage *message) {
    const char *folder = location != NULL && is_uri ? begin_of_path(location) : location;
    if (folder == NULL && is_uri) {
        slide_say(message, "fmuResourceLocation %s; expected file:///path/to/resources",
                  location == NULL ? "is NULL" : location);
    } else if (folder == NULL) {
        slide_say(message, "the path of the resources is NULL; expected /path/to/resources/");
    }
    if (folder == NULL) {
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
    unsigned char *data = NULL;
    long end = -1;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0) {
        end = ftell(file);
    }
    if (end >= 0 && fseek(file, 0, SEEK_SET) == 0) {
        *size = (size_t)end;
        data = malloc(*size + 1);
    }
    if (data != NULL && fread(data, 1, *size, file) != *size) {
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
