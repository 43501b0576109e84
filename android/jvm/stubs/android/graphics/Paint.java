package android.graphics;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Paint {
    public boolean isAntiAlias() {
        return false;
    }

    public void setAntiAlias(boolean on) {}

    public float getStrokeWidth() {
        return 0;
    }

    public void setStrokeWidth(float width) {}

    public int getColor() {
        return 0;
    }

    public void setColor(int color) {}

    public int getAlpha() {
        return 0;
    }

    public void setAlpha(int alpha) {}

    public Style getStyle() {
        return Style.FILL;
    }

    public void setStyle(Style style) {}

    /** How shapes are painted. */
    public enum Style {
        FILL,
        STROKE
    }
}
