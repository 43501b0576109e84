package android.graphics;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Typeface {
    public static final Typeface MONOSPACE = new Typeface();
}
