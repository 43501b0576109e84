package dev.foresound;

/** The native library cannot be had on this device; the text says why, and what to do. */
public final class UnavailableException extends IllegalStateException {
    UnavailableException(String message, Throwable cause) {
        super(message, cause);
    }
}
