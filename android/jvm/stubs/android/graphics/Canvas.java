package android.graphics;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Canvas {
    public void drawColor(int color) {}

    public void drawRect(float left, float top, float right, float bottom, Paint paint) {}

    public void drawLine(float fromX, float fromY, float toX, float toY, Paint paint) {}

    public void drawCircle(float x, float y, float radius, Paint paint) {}
}
